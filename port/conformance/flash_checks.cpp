// The checks of a flash device, each from an erased block on.
#include "conformance/flash_bench.hpp"

namespace mellin::port {
namespace {

constexpr std::uint8_t kOld = 1;  ///< salts: what was there before
constexpr std::uint8_t kNew = 2;

/// A block with a block on each side where there are three, and those neighbours.
struct Trio {
  std::uint32_t middle;
  std::uint32_t before;
  std::uint32_t after;
};

Trio trio(const FlashBench& bench) {
  const std::uint32_t middle = bench.sample(bench.sample_count() / 2);
  return {middle, middle > 0 ? middle - 1 : middle + 1, middle < bench.last_block() ? middle + 1 : middle - 1};
}

bool fill_neighbours(FlashBench& bench, const Trio& at) {
  return bench.erase(at.before) && bench.fill(at.before, kOld) &&
         (at.after == at.before || (bench.erase(at.after) && bench.fill(at.after, kOld)));
}

bool neighbours_hold(FlashBench& bench, const Trio& at) {
  return bench.holds(at.before, kOld) && bench.holds(at.after, kOld);
}

/// The block's units that are programmed one by one: the first, one in the middle, the last.
template <class Visit>
bool each_unit(const FlashBench& bench, std::uint32_t block, const Visit& visit) {
  const std::uint32_t units = bench.block_size() / bench.unit();
  const std::uint32_t which[] = {0, units / 2, units - 1};
  for (std::uint32_t i = 0; i < 3; ++i) {
    if (i > 0 && which[i] == which[i - 1]) {
      continue;
    }
    if (!visit(bench.start_of(block) + which[i] * bench.unit())) {
      return false;
    }
  }
  return true;
}

Finding geometry(Subject& subject) {
  FlashBench bench(subject);
  const mellin_flash& flash = bench.flash();
  if (flash.block_count == 0) {
    return {Outcome::absent, LogLine() << "block_count is 0: maps are not kept"};
  }
  if (flash.block_count < 2) {
    bench.fail(LogLine() << "block_count " << flash.block_count << ", expected 2 or more");
  } else if (flash.program_unit == 0 || flash.program_unit > 2048 ||
             (flash.program_unit & (flash.program_unit - 1)) != 0) {
    bench.fail(LogLine() << "program_unit " << flash.program_unit << ", expected a power of two up to 2048");
  } else if (flash.block_size == 0 || flash.block_size % flash.program_unit != 0) {
    bench.fail(LogLine() << "block_size " << flash.block_size << ", expected a multiple of program_unit "
                         << flash.program_unit);
  } else if (bench.size() > std::uint64_t{1} << 32U) {
    bench.fail(LogLine() << bench.size() << " bytes, more than 32-bit addresses reach");
  } else if (flash.read == nullptr || flash.program == nullptr || flash.erase == nullptr || flash.sync == nullptr) {
    bench.fail(LogLine() << "read, program, erase or sync is a null pointer");
  }
  Finding finding = bench.finding();
  if (finding.outcome == Outcome::passed) {
    finding.text << flash.block_count << " blocks of " << flash.block_size << " bytes, units of " << flash.program_unit;
  }
  return finding;
}

Finding erase_complete(Subject& subject) {
  FlashBench bench(subject);
  for (std::uint32_t i = 0; i < bench.sample_count(); ++i) {
    const std::uint32_t block = bench.sample(i);
    if (!(bench.erase(block) && bench.fill(block, kOld) && bench.erase(block) &&
          bench.verify_erased(bench.start_of(block), bench.block_size()))) {
      break;
    }
  }
  return bench.finding();
}

Finding erase_neighbours(Subject& subject) {
  FlashBench bench(subject);
  const Trio at = trio(bench);
  (void)(fill_neighbours(bench, at) && bench.erase(at.middle) && neighbours_hold(bench, at));
  return bench.finding();
}

Finding program_exact(Subject& subject) {
  FlashBench bench(subject);
  const std::uint32_t block = trio(bench).middle;
  const auto put = [&](std::uint32_t address) { return bench.program(address, bench.unit(), kNew); };
  const auto holds = [&](std::uint32_t address) { return bench.verify(address, bench.unit(), kNew); };
  (void)(bench.erase(block) && each_unit(bench, block, put) && each_unit(bench, block, holds) && bench.erase(block) &&
         bench.fill(block, kOld) && bench.holds(block, kOld));
  return bench.finding();
}

/// One unit, amid erased ones, between two blocks that hold something.
Finding program_neighbours(Subject& subject) {
  FlashBench bench(subject);
  const Trio at = trio(bench);
  const std::uint32_t unit = bench.unit();
  const std::uint32_t from = bench.start_of(at.middle);
  const std::uint32_t units = bench.block_size() / unit;
  const std::uint32_t before = units / 2 * unit;
  (void)(fill_neighbours(bench, at) && bench.erase(at.middle) && bench.program(from + before, unit, kNew) &&
         bench.verify_erased(from, before) &&
         bench.verify_erased(from + before + unit, bench.block_size() - before - unit) && neighbours_hold(bench, at));
  return bench.finding();
}

/// Many units in one call that starts off a page's boundary, where a device with pages has to split it.
Finding program_run(Subject& subject) {
  FlashBench bench(subject);
  const std::uint32_t block = trio(bench).middle;
  const std::uint32_t unit = bench.unit();
  std::uint32_t size = bench.block_size() - bench.block_size() % unit - unit;
  size = size < Subject::kBuffer ? size : Subject::kBuffer / unit * unit;
  if (size == 0) {
    return {Outcome::passed, LogLine() << "a block is a unit here"};
  }
  const std::uint32_t from = bench.start_of(block) + unit;
  (void)(bench.erase(block) && bench.program(from, size, kNew) && bench.verify(from, size, kNew) &&
         bench.verify_erased(from - unit, unit));
  return bench.finding();
}

Finding program_pointer(Subject& subject) {
  FlashBench bench(subject);
  const std::uint32_t block = trio(bench).middle;
  const std::uint32_t unit = bench.unit();
  if (!bench.erase(block)) {
    return bench.finding();
  }
  for (std::uint32_t shift = 1; shift < 4 && shift * unit < bench.block_size(); ++shift) {
    const std::uint32_t address = bench.start_of(block) + shift * unit;
    bench.lay(subject.out + shift, address, unit, kNew);
    const int result = bench.flash().program(bench.flash().context, address, subject.out + shift, unit);
    if (!bench.succeeded("program", address, result) || !bench.verify(address, unit, kNew)) {
      break;
    }
  }
  return bench.finding();
}

/// Reads that start and end anywhere, into memory of any alignment, also across the border of two blocks.
Finding read_anywhere(Subject& subject) {
  FlashBench bench(subject);
  const std::uint32_t first = trio(bench).middle < bench.last_block() ? trio(bench).middle : trio(bench).before;
  if (!(bench.erase(first) && bench.fill(first, kNew) && bench.erase(first + 1) && bench.fill(first + 1, kNew))) {
    return bench.finding();
  }
  const std::uint32_t border = bench.start_of(first + 1);
  const std::uint32_t starts[] = {bench.start_of(first), bench.start_of(first) + 1, border - 5, border - 1, border};
  const std::uint32_t sizes[] = {1, 2, 3, 5, 7, 16, 33};
  for (const std::uint32_t start : starts) {
    for (const std::uint32_t size : sizes) {
      if (start < bench.start_of(first) || start + size > border + bench.block_size()) {
        continue;  // blocks of a few bytes
      }
      std::uint8_t* const to = subject.in + size % Subject::kGuard;
      const int result = bench.flash().read(bench.flash().context, start, to, size);
      if (!bench.succeeded("read", start, result) || !bench.same(to, start, size, kNew)) {
        return bench.finding();
      }
    }
  }
  return bench.finding();
}

Finding read_buffer(Subject& subject) {
  FlashBench bench(subject);
  constexpr std::uint8_t kUntouched = 0xA5;
  constexpr std::uint32_t kAt = Subject::kGuard;
  for (std::uint32_t size = 0; size < 20; ++size) {
    for (std::uint8_t& byte : subject.in) {
      byte = kUntouched;
    }
    const int result = bench.flash().read(bench.flash().context, 1, subject.in + kAt, size);
    if (!bench.succeeded("read", 1, result)) {
      break;
    }
    for (std::uint32_t i = 0; i < 64; ++i) {
      if ((i < kAt || i >= kAt + size) && subject.in[i] != kUntouched) {
        bench.fail(LogLine() << "read of " << size << " bytes changed the byte at "
                             << static_cast<std::int32_t>(i) - static_cast<std::int32_t>(kAt) << " of the buffer");
        return bench.finding();
      }
    }
  }
  return bench.finding();
}

/// Fills the device's ends, so that an address that wraps round is seen; what they hold is checked by ends_hold().
bool fill_ends(FlashBench& bench) {
  return bench.erase(0) && bench.fill(0, kOld) && bench.erase(bench.last_block()) &&
         bench.fill(bench.last_block(), kOld);
}
bool ends_hold(FlashBench& bench) { return bench.holds(0, kOld) && bench.holds(bench.last_block(), kOld); }

bool refused(FlashBench& bench, const char* call, std::uint32_t where, int result) {
  return result != 0 || bench.fail(LogLine() << call << "(" << where << ") outside the device returned 0");
}

/// Tries addresses outside, and one from which the size reaches outside.
template <class Call>
Finding bounds(FlashBench& bench, const char* name, const Call& call) {
  if (!fill_ends(bench)) {
    return bench.finding();
  }
  const std::uint32_t unit = bench.unit();
  const auto end = static_cast<std::uint32_t>(bench.size());  // 0 for 2^32 bytes: nothing lies beyond them
  bool good = refused(bench, name, end - unit, call(end - unit, 2 * unit));
  if (end != 0) {
    good = good && refused(bench, name, end, call(end, unit)) &&
           refused(bench, name, 0U - unit, call(0U - unit, unit)) &&
           refused(bench, name, 0U - unit, call(0U - unit, 2 * unit));
  }
  (void)(good && ends_hold(bench));
  return bench.finding();
}

Finding read_bounds(Subject& subject) {
  FlashBench bench(subject);
  const mellin_flash& flash = bench.flash();
  return bounds(bench, "read", [&](std::uint32_t address, std::uint32_t size) {
    return flash.read(flash.context, address, subject.in, size);
  });
}

Finding program_bounds(Subject& subject) {
  FlashBench bench(subject);
  const mellin_flash& flash = bench.flash();
  return bounds(bench, "program", [&](std::uint32_t address, std::uint32_t size) {
    bench.lay(subject.out, 0, size, kNew);
    return flash.program(flash.context, address, subject.out, size);
  });
}

Finding erase_bounds(Subject& subject) {
  FlashBench bench(subject);
  const mellin_flash& flash = bench.flash();
  (void)(fill_ends(bench) &&
         refused(bench, "erase", flash.block_count, flash.erase(flash.context, flash.block_count)) &&
         refused(bench, "erase", 0xFFFFFFFFU, flash.erase(flash.context, 0xFFFFFFFFU)) && ends_hold(bench));
  return bench.finding();
}

/// Every tested block with contents of its own: an address line that is not connected makes two of them one. Then each
/// erase leaves all later ones as they were.
Finding blocks_distinct(Subject& subject) {
  FlashBench bench(subject);
  const std::uint32_t count = bench.sample_count();
  const auto salt = [](std::uint32_t i) { return static_cast<std::uint8_t>(10 + i); };
  for (std::uint32_t i = 0; i < count; ++i) {
    if (!bench.erase(bench.sample(i)) || !bench.fill(bench.sample(i), salt(i))) {
      return bench.finding();
    }
  }
  for (std::uint32_t erased = 0; erased < count; ++erased) {
    for (std::uint32_t i = erased; i < count; ++i) {
      if (!bench.holds(bench.sample(i), salt(i))) {
        return bench.finding();
      }
    }
    if (!bench.erase(bench.sample(erased))) {
      return bench.finding();
    }
  }
  return bench.finding();
}

/// The same unit twice: what it then holds, and whether that is refused, is the device's affair; what lies beside it is
/// not.
Finding reprogram(Subject& subject) {
  FlashBench bench(subject);
  const Trio at = trio(bench);
  const std::uint32_t unit = bench.unit();
  const std::uint32_t from = bench.start_of(at.middle);
  const std::uint32_t address = from + bench.block_size() / unit / 2 * unit;
  if (!(fill_neighbours(bench, at) && bench.erase(at.middle) && bench.fill(at.middle, kOld))) {
    return bench.finding();
  }
  bench.lay(subject.out, address, unit, kNew);
  const int result = bench.flash().program(bench.flash().context, address, subject.out, unit);
  const std::uint32_t behind = address + unit;
  if (bench.verify(from, address - from, kOld) && bench.verify(behind, from + bench.block_size() - behind, kOld) &&
      neighbours_hold(bench, at)) {
    return {Outcome::passed, LogLine() << (result != 0 ? "refused here" : "not refused here")};
  }
  return bench.finding();
}

Finding sync(Subject& subject) {
  FlashBench bench(subject);
  const std::uint32_t block = trio(bench).middle;
  (void)(bench.erase(block) && bench.sync() && bench.fill(block, kNew) && bench.sync() && bench.sync() &&
         bench.holds(block, kNew));
  return bench.finding();
}

Finding cycles(Subject& subject) {
  constexpr std::uint8_t kCycles = 16;
  FlashBench bench(subject);
  const std::uint32_t block = trio(bench).middle;
  for (std::uint8_t i = 0; i < kCycles; ++i) {
    const auto salt = static_cast<std::uint8_t>(100 + i);
    if (!(bench.erase(block) && bench.fill(block, salt) && bench.holds(block, salt))) {
      break;
    }
  }
  return bench.finding();
}

Finding left_erased(Subject& subject) {
  FlashBench bench(subject);
  const Trio at = trio(bench);
  bool good = bench.erase(at.before) && bench.erase(at.after);
  for (std::uint32_t i = 0; good && i < bench.sample_count(); ++i) {
    good = bench.erase(bench.sample(i));
  }
  (void)(good && bench.sync());
  return bench.finding();
}

constexpr Check kChecks[] = {
    {"flash.geometry", "block_count at least 2, block_size a multiple of program_unit, that a power of two up to 2048",
     geometry},
    {"flash.erase_complete", "after erase each byte of the block reads erased_value", erase_complete},
    {"flash.erase_neighbours", "erase touches its own block only", erase_neighbours},
    {"flash.program_exact", "program stores what it was given, in any unit of a block", program_exact},
    {"flash.program_neighbours", "program touches nothing beside what it was given", program_neighbours},
    {"flash.program_run", "program takes any number of units in one call, across the device's pages", program_run},
    {"flash.program_pointer", "program takes data of any alignment", program_pointer},
    {"flash.read_anywhere", "read takes any address and size inside the device, and any alignment of the buffer",
     read_anywhere},
    {"flash.read_buffer", "read writes the bytes asked for and none beside them", read_buffer},
    {"flash.read_bounds", "read refuses what reaches outside the device", read_bounds},
    {"flash.program_bounds", "program refuses what reaches outside the device, with nothing touched", program_bounds},
    {"flash.erase_bounds", "erase refuses a block that is not there, with nothing touched", erase_bounds},
    {"flash.blocks_distinct", "each block is there and holds its own data until it is erased", blocks_distinct},
    {"flash.reprogram", "program over data fails or spoils that data, but nothing beside it", reprogram},
    {"flash.sync", "sync returns 0 and loses nothing", sync},
    {"flash.cycles", "a block can be erased and programmed again and again", cycles},
    {"flash.left_erased", "erase and sync after all this succeed", left_erased},
};

}  // namespace

Span<const Check> flash_checks() { return {kChecks, sizeof kChecks / sizeof *kChecks}; }

}  // namespace mellin::port
