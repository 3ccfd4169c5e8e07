// What the store's tests share: a strict model of flash whose power can be cut, grids, and a store with its memory.
#pragma once

#include <cstdint>
#include <cstring>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "mellin/store/submap_store.hpp"

namespace mellin::test {

/// std::mt19937 with results of 32 bits (its own are unsigned long).
class Random32 {
 public:
  explicit Random32(std::uint32_t seed) : engine_(seed) {}
  std::uint32_t operator()() { return static_cast<std::uint32_t>(engine_()); }

 private:
  std::mt19937 engine_;
};

struct Geometry {
  std::uint32_t block_size;
  std::uint32_t block_count;
  std::uint32_t unit;
};

/// Flash in memory. It knows which units were programmed since they were erased, also those that a power cut left
/// looking erased, and counts each violation. `operations_left` programs and erases succeed; the next one is torn, and
/// after that the power is off. What was not synced may be lost: with `reorder`, any of it.
class TornFlash {
 public:
  explicit TornFlash(const Geometry& geometry)
      : geometry_(geometry),
        bytes_(std::size_t{geometry.block_size} * geometry.block_count, 0xFF),
        touched_(bytes_.size() / geometry.unit, false) {}

  mellin_flash flash() {
    mellin_flash flash{};
    flash.context = this;
    flash.read = [](void* c, std::uint32_t a, void* b, std::uint32_t n) { return self(c).read(a, b, n); };
    flash.program = [](void* c, std::uint32_t a, const void* b, std::uint32_t n) { return self(c).program(a, b, n); };
    flash.erase = [](void* c, std::uint32_t block) { return self(c).erase(block); };
    flash.sync = [](void* c) { return self(c).sync(); };
    flash.block_size = geometry_.block_size;
    flash.block_count = geometry_.block_count;
    flash.program_unit = geometry_.unit;
    flash.erased_value = 0xFF;
    return flash;
  }

  /// Cuts the power at the `operations`-th program or erase from now.
  void cut_after(std::uint64_t operations, std::uint32_t seed, bool reorder = false) {
    left_ = operations;
    random_.seed(seed);
    reorder_ = reorder;
  }
  /// Power on again. What was under way stays as it was torn.
  void restore() {
    off_ = false;
    left_ = UINT64_MAX;
    unsynced_.clear();
  }
  bool off() const { return off_; }
  std::uint64_t operations() const { return operations_; }
  int violations() const { return violations_; }
  std::vector<std::uint8_t>& bytes() { return bytes_; }
  int fail_erase_of = -1;  ///< a block that cannot be erased

 private:
  struct Change {
    std::size_t at;
    std::vector<std::uint8_t> before;
  };
  static TornFlash& self(void* context) { return *static_cast<TornFlash*>(context); }

  int read(std::uint32_t address, void* buffer, std::uint32_t size) {
    if (off_) {
      return -1;
    }
    if (std::size_t{address} + size > bytes_.size()) {
      ++violations_;
      return -1;
    }
    std::memcpy(buffer, bytes_.data() + address, size);
    return 0;
  }

  int program(std::uint32_t address, const void* data, std::uint32_t size) {
    if (off_) {
      return -1;
    }
    const bool aligned = address % geometry_.unit == 0 && size % geometry_.unit == 0 && size > 0;
    if (!aligned || std::size_t{address} + size > bytes_.size()) {
      ++violations_;
      return -1;
    }
    for (std::size_t unit = address / geometry_.unit; unit < (address + size) / geometry_.unit; ++unit) {
      violations_ += touched_[unit] ? 1 : 0;
      touched_[unit] = true;
    }
    remember(address, size);
    const auto* const from = static_cast<const std::uint8_t*>(data);
    if (power_goes()) {
      tear_program(address, from, size);
      return -1;
    }
    std::memcpy(bytes_.data() + address, from, size);
    return 0;
  }

  int erase(std::uint32_t block) {
    if (off_) {
      return -1;
    }
    if (block >= geometry_.block_count) {
      ++violations_;
      return -1;
    }
    if (fail_erase_of == static_cast<int>(block)) {
      return -1;
    }
    const std::size_t at = std::size_t{block} * geometry_.block_size;
    remember(at, geometry_.block_size);
    const bool torn = power_goes();
    for (std::size_t i = at; i < at + geometry_.block_size; ++i) {
      bytes_[i] = static_cast<std::uint8_t>(torn ? bytes_[i] | random_() : 0xFFU);
    }
    for (std::size_t unit = at / geometry_.unit; unit < (at + geometry_.block_size) / geometry_.unit; ++unit) {
      touched_[unit] = torn;
    }
    return torn ? -1 : 0;
  }

  int sync() {
    if (off_) {
      return -1;
    }
    unsynced_.clear();
    return 0;
  }

  void remember(std::size_t at, std::size_t size) {
    if (reorder_) {
      unsynced_.push_back({at, std::vector<std::uint8_t>(bytes_.begin() + static_cast<std::ptrdiff_t>(at),
                                                         bytes_.begin() + static_cast<std::ptrdiff_t>(at + size))});
    }
  }

  /// Whether this operation is the one during which the power goes. Earlier ones that no sync made safe may then be
  /// found undone, in any combination.
  bool power_goes() {
    ++operations_;
    if (left_-- != 0) {
      return false;
    }
    off_ = true;
    for (std::size_t i = 0; reorder_ && i + 1 < unsynced_.size(); ++i) {
      if (random_() % 2 == 0) {
        std::memcpy(bytes_.data() + unsynced_[i].at, unsynced_[i].before.data(), unsynced_[i].before.size());
      }
    }
    return true;
  }

  /// A prefix programmed whole, then a random subset of the bits of the rest; one time in four nothing at all.
  void tear_program(std::size_t at, const std::uint8_t* from, std::size_t size) {
    if (random_() % 4 == 0) {
      return;
    }
    const std::size_t whole = random_() % (size + 1);
    for (std::size_t i = 0; i < size; ++i) {
      const auto keep = static_cast<std::uint8_t>(i < whole ? 0U : random_());
      bytes_[at + i] = static_cast<std::uint8_t>(bytes_[at + i] & (from[i] | keep));
    }
  }

  Geometry geometry_;
  std::vector<std::uint8_t> bytes_;
  std::vector<bool> touched_;
  std::vector<Change> unsynced_;
  std::mt19937 random_;
  std::uint64_t left_ = UINT64_MAX;
  std::uint64_t operations_ = 0;
  int violations_ = 0;
  bool off_ = false;
  bool reorder_ = false;
};

/// A store with exactly the memory that it asks for.
class TestStore {
 public:
  explicit TestStore(const StoreConfig& config, const mellin_flash& flash, mellin_log log = {}) : config_(config) {
    MeasureArena measure;
    static_cast<void>(SubmapStore::carve(measure, config));
    memory_.resize(measure.use().total() / sizeof(std::uint64_t));
    Arena arena(Span<std::byte>(reinterpret_cast<std::byte*>(memory_.data()), measure.use().total()));
    const SubmapStore::Memory memory = SubmapStore::carve(arena, config);
    fits_exactly = arena.ok() && arena.use().total() == measure.use().total();
    init_status = store.init(config, memory, flash, Log(log));
  }

  /// Steps until the job is done.
  Status drain() {
    Status status = Status::busy;
    for (int i = 0; i < 1'000'000 && status == Status::busy; ++i) {
      status = store.step();
    }
    return status;
  }
  Status fetch(SubmapId id) {
    Status status = store.begin_fetch(id);
    if (status == Status::ok) {
      do {
        status = store.step_fetch();
      } while (status == Status::busy);
    }
    return status;
  }
  /// The submap's cells, empty where it cannot be had.
  std::vector<std::uint8_t> cells(SubmapId id) {
    if (fetch(id) != Status::ok) {
      return {};
    }
    Result<SlotHandle> slot = store.slot(id);
    if (!slot.ok()) {
      return {};
    }
    const GridView grid = store.slots().view(slot.value());
    std::vector<std::uint8_t> copy(grid.cells.begin(), grid.cells.end());
    static_cast<void>(store.slots().release(slot.value()));
    return copy;
  }
  /// One group of a submap and a blob of kind 1.
  Status put(const SubmapHeader& header, const std::vector<std::uint8_t>& cells,
             const std::vector<std::uint8_t>& blob) {
    Status status = store.begin_group({1, 1, static_cast<std::uint32_t>(blob.size())});
    if (status != Status::ok) {
      return status;
    }
    const GridView grid{Span<const std::uint8_t>(cells.data(), cells.size()), config_.side, config_.cell_m};
    status = store.put_submap(header, grid);
    status = status == Status::ok ? drain() : status;
    if (status == Status::ok) {
      status = store.put_blob(1, header.id, Span<const std::uint8_t>(blob.data(), blob.size()));
    }
    status = status == Status::ok ? drain() : status;
    status = status == Status::ok ? store.commit() : status;
    return status == Status::ok ? drain() : status;
  }

  SubmapStore store;
  Status init_status = Status::ok;
  bool fits_exactly = false;

 private:
  StoreConfig config_;
  std::vector<std::uint64_t> memory_;
};

inline StoreConfig small_config(std::uint16_t side = 64) {
  StoreConfig config;
  config.side = side;
  config.cell_m = 0.05F;
  config.max_submaps = 64;
  config.max_blobs = 64;
  config.grid_slots = 2;
  config.page_bytes = 256;
  config.fingerprint = 0x1234567890ABCDEFU;
  return config;
}

inline SubmapHeader sample_header(SubmapId id) {
  SubmapHeader header;
  header.id = id;
  for (int i = 0; i < 16; ++i) {
    header.session.bytes[i] = static_cast<std::uint8_t>(id * 31 + static_cast<unsigned>(i));
  }
  header.session_T_submap = {1.5 * id, -0.25, 0.1};
  header.submap_T_robot = {0.125, 1.0 / 3.0, -3.0};
  header.stamp_us = -1234567890123LL + id;
  header.first_scan = id * 10;
  header.scan_count = 40;
  return header;
}

inline std::vector<std::uint8_t> random_bytes(std::size_t size, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<std::uint8_t> bytes(size);
  for (std::uint8_t& byte : bytes) {
    byte = static_cast<std::uint8_t>(random());
  }
  return bytes;
}

/// Rooms: unobserved outside, free inside, walls of varied certainty, some noise.
inline std::vector<std::uint8_t> room_grid(std::uint16_t side, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<std::uint8_t> cells(std::size_t{side} * side, kUnobserved);
  const auto at = [&](std::uint32_t c, std::uint32_t r) -> std::uint8_t& { return cells[std::size_t{r} * side + c]; };
  const std::uint32_t low = side / 8U + random() % 4;
  const std::uint32_t high = side - side / 8U - random() % 4;
  for (std::uint32_t r = low; r < high; ++r) {
    for (std::uint32_t c = low; c < high; ++c) {
      const bool wall = r == low || c == low || r + 1 == high || c + 1 == high || (c == side / 2U && r % 16 > 4);
      at(c, r) = static_cast<std::uint8_t>(wall ? 100 + random() % 155 : random() % 50 == 0 ? random() % 60 : 0);
    }
  }
  return cells;
}

inline bool same(const SubmapHeader& a, const SubmapHeader& b) {
  const auto pose = [](const Pose2& p, const Pose2& q) { return p.x == q.x && p.y == q.y && p.theta == q.theta; };
  return a.id == b.id && a.session == b.session && pose(a.session_T_submap, b.session_T_submap) &&
         pose(a.submap_T_robot, b.submap_T_robot) && a.stamp_us == b.stamp_us && a.first_scan == b.first_scan &&
         a.scan_count == b.scan_count;
}

}  // namespace mellin::test
