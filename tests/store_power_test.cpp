// Power cuts and damage: what was committed is there bit by bit, what was not is absent, and no image does harm.
#include <doctest.h>

#include <algorithm>

#include "store_fixture.hpp"
#include "tests/support/sorted_map.hpp"
#include "tests/support/trials.hpp"

using namespace mellin;
using namespace mellin::test;

namespace {

using Bytes = std::vector<std::uint8_t>;

/// What a group put, or was about to.
struct Content {
  Bytes cells;
  Bytes blob;
};
using Model = SortedMap<SubmapId, Content>;

Bytes blob_of(const SubmapStore& store, std::uint32_t id) {
  Bytes out(10'000);
  const Result<std::size_t> size = store.read_blob(1, id, Span<std::uint8_t>(out.data(), out.size()));
  out.resize(size.ok() ? size.value() : 0);
  return out;
}

Content content(SubmapId id, std::uint32_t version) {
  const std::uint32_t seed = id * 100 + version;
  return {id % 3 == 2 ? random_bytes(4096, seed) : room_grid(64, seed), random_bytes(50 + 700 * (id % 2), seed)};
}

/// A script of groups: new submaps, a replaced one, a removed one. Keeps the model of what was reported as stored, and
/// of what it will be once the group that fails is in.
Status remove_group(TestStore& t, SubmapId id) {
  Status status = t.store.begin_group({0, 2, 0});
  status = status == Status::ok ? t.store.remove_submap(id) : status;
  status = status == Status::ok ? t.drain() : status;
  status = status == Status::ok ? t.store.remove_blob(1, id) : status;
  status = status == Status::ok ? t.drain() : status;
  status = status == Status::ok ? t.store.commit() : status;
  return status == Status::ok ? t.drain() : status;
}

void run(TestStore& t, Model& stored, Model& under_way, SubmapId first) {
  for (int step = 0; step < 5; ++step) {
    under_way = stored;
    Status status = Status::ok;
    if (step == 3) {
      under_way.erase(first + 1);
      status = remove_group(t, first + 1);
    } else {
      const SubmapId id = step == 4 ? first : first + static_cast<SubmapId>(step);
      under_way[id] = content(id, static_cast<std::uint32_t>(step));
      status = t.put(sample_header(id), under_way[id].cells, under_way[id].blob);
    }
    if (status != Status::ok) {
      return;
    }
    stored = under_way;
  }
}

bool holds(TestStore& t, const Model& model) {
  if (t.store.submap_count() != model.size() || t.store.blob_count(1) != model.size()) {
    return false;
  }
  return std::all_of(model.begin(), model.end(), [&](const auto& item) {
    const Result<SubmapHeader> header = t.store.header(item.first);
    return header.ok() && same(header.value(), sample_header(item.first)) && t.cells(item.first) == item.second.cells &&
           blob_of(t.store, item.first) == item.second.blob;
  });
}

StoreConfig config_for(const Geometry& geometry) {
  StoreConfig config = small_config();
  config.page_bytes = static_cast<std::uint16_t>(std::max<std::uint32_t>(256, geometry.unit));
  return config;
}

/// Operations of the whole script without a cut.
std::uint64_t script_length(const Geometry& geometry) {
  TornFlash flash(geometry);
  TestStore t(config_for(geometry), flash.flash());
  REQUIRE(t.store.format() == Status::ok);
  Model stored;
  Model under_way;
  run(t, stored, under_way, 0);
  REQUIRE(stored.size() == 2);
  CHECK(holds(t, stored));
  return flash.operations();
}

void cut_everywhere(const Geometry& geometry, bool reorder) {
  const std::uint64_t length = script_length(geometry);
  int wrong = 0;
  int whole = 0;
  for (std::uint64_t cut = 0; cut < length; cut += 20 / static_cast<std::uint64_t>(trials(20))) {
    TornFlash flash(geometry);
    Model stored;
    Model under_way;
    flash.cut_after(cut, static_cast<std::uint32_t>(cut), reorder);
    {
      TestStore t(config_for(geometry), flash.flash());
      if (t.store.format() == Status::ok) {
        run(t, stored, under_way, 0);
      }
    }
    flash.restore();
    TestStore t(config_for(geometry), flash.flash());
    if (t.store.mount() != Status::ok) {
      wrong += stored.empty() && t.store.format() == Status::ok ? 0 : 1;
    }
    const bool old_state = holds(t, stored);
    wrong += old_state || holds(t, under_way) ? 0 : 1;
    whole += old_state ? 0 : 1;
    // The store goes on from there, is cut again, and goes on.
    stored = old_state ? stored : under_way;
    flash.cut_after(cut / 2 + 1, static_cast<std::uint32_t>(cut + 1000), reorder);
    run(t, stored, under_way, 10);
    flash.restore();
    TestStore again(config_for(geometry), flash.flash());
    wrong += again.store.mount() == Status::ok && (holds(again, stored) || holds(again, under_way)) ? 0 : 1;
    wrong += again.store.statistics().lost_records == 0 ? 0 : 1;
    wrong += flash.violations();
  }
  CHECK(wrong == 0);
  CHECK(length > 15);
  CHECK(whole < static_cast<int>(length) / 2);  // a cut mostly leaves the old state, or the script tests nothing
}

/// A store of five submaps and its image.
Bytes written_image(const Geometry& geometry, Model& model) {
  TornFlash flash(geometry);
  TestStore t(config_for(geometry), flash.flash());
  REQUIRE(t.store.format() == Status::ok);
  for (SubmapId id = 0; id < 5; ++id) {
    model[id] = content(id, 0);
    REQUIRE(t.put(sample_header(id), model[id].cells, model[id].blob) == Status::ok);
  }
  return flash.bytes();
}

/// Reads everything; returns how many submaps and blobs came back right, and counts wrong ones.
std::size_t read_all(TestStore& t, const Model& model, int& wrong) {
  std::size_t right = 0;
  for (const auto& [id, content] : model) {
    const Bytes cells = t.cells(id);
    const Bytes blob = blob_of(t.store, id);
    wrong += !cells.empty() && cells != content.cells ? 1 : 0;
    wrong += !blob.empty() && blob != content.blob ? 1 : 0;
    right += (cells == content.cells ? 1U : 0U) + (blob == content.blob ? 1U : 0U);
    static_cast<void>(t.store.grid_crc32(id).ok());
  }
  return right;
}

}  // namespace

TEST_CASE("power cut at every operation, torn in order") {
  cut_everywhere({4096, 64, 256}, false);
  cut_everywhere({4096, 64, 64}, false);
  cut_everywhere({8192, 32, 2048}, false);
  cut_everywhere({4096, 64, 1}, false);
}

TEST_CASE("power cut at every operation, unsynced ones undone at random") {
  cut_everywhere({4096, 64, 256}, true);
  cut_everywhere({8192, 32, 2048}, true);
  cut_everywhere({131072, 8, 16}, true);
}

TEST_CASE("a block that cannot be erased is passed over") {
  TornFlash flash({4096, 32, 256});
  flash.fail_erase_of = 2;
  Model stored;
  Model under_way;
  TestStore t(config_for({4096, 32, 256}), flash.flash());
  REQUIRE(t.store.format() == Status::ok);
  run(t, stored, under_way, 0);
  CHECK(stored.size() == 2);
  REQUIRE(t.store.mount() == Status::ok);
  CHECK(holds(t, stored));
}

TEST_CASE("a bit flip costs at most what it hits, and never gives wrong content") {
  const Geometry geometry{4096, 32, 256};
  Model model;
  const Bytes image = written_image(geometry, model);
  Random32 random(3);
  std::size_t used = image.size();
  while (used > 0 && image[used - 1] == 0xFF) {
    --used;
  }
  int wrong = 0;
  std::size_t hurt = 0;
  std::size_t worst = 2 * model.size();
  for (int trial = 0; trial < trials(1500); ++trial) {
    TornFlash flash(geometry);
    flash.bytes() = image;
    const std::size_t bit = random() % (used * 8);
    flash.bytes()[bit / 8] = static_cast<std::uint8_t>(flash.bytes()[bit / 8] ^ (1U << bit % 8));
    TestStore t(config_for(geometry), flash.flash());
    const Status mounted = t.store.mount();
    wrong += mounted == Status::ok ? 0 : 1;
    const std::size_t right = read_all(t, model, wrong);
    hurt += right < 2 * model.size() ? 1U : 0U;
    worst = std::min(worst, right);
    wrong += t.store.submap_count() > model.size() ? 1 : 0;
    const StoreStatistics statistics = t.store.statistics();
    // What is missing is told, but for the last group, which might not have been committed at all.
    const bool told = statistics.lost_records > 0 || statistics.damaged_blocks > 0 || !t.store.contains(4) ||
                      blob_of(t.store, 4).empty();
    bool readable = true;
    for (const auto& [id, content] : model) {
      readable = readable && blob_of(t.store, id) == content.blob;
    }
    wrong += right < 2 * model.size() && !told && readable ? 1 : 0;
  }
  CHECK(wrong == 0);
  CHECK(hurt > static_cast<std::size_t>(trials(1500)) / 3);  // the flips do hit something
  CHECK(worst >= 4);  // a damaged block header takes a block of 4 KiB with it, no more
}

TEST_CASE("a damaged submap is lost, the rest is served") {
  const Geometry geometry{4096, 32, 256};
  Model model;
  TornFlash flash(geometry);
  flash.bytes() = written_image(geometry, model);
  // Submap 2 has random cells, stored raw: break one of its bytes.
  const Bytes& cells = model[2].cells;
  const auto at = std::search(flash.bytes().begin(), flash.bytes().end(), cells.begin(), cells.begin() + 32);
  REQUIRE(at != flash.bytes().end());
  *at ^= 0x40U;
  TestStore t(config_for(geometry), flash.flash());
  REQUIRE(t.store.mount() == Status::ok);
  CHECK(t.fetch(2) == Status::lost);
  CHECK_FALSE(t.store.is_resident(2));
  CHECK(t.store.slots().pinned() == 0);
  CHECK(t.store.statistics().lost_records == 1);
  CHECK(t.store.header(2).ok());
  int wrong = 0;
  CHECK(read_all(t, model, wrong) == 9);
  CHECK(wrong == 0);
}

TEST_CASE("truncated images, with the end erased or zero, keep what lies before") {
  const Geometry geometry{4096, 32, 256};
  Model model;
  const Bytes image = written_image(geometry, model);
  int wrong = 0;
  std::size_t last = 0;
  for (std::size_t keep = 4096; keep < image.size(); keep += 777 * 20 / static_cast<std::size_t>(trials(20))) {
    for (const std::uint8_t fill : {std::uint8_t{0xFF}, std::uint8_t{0}}) {
      TornFlash flash(geometry);
      flash.bytes() = image;
      std::fill(flash.bytes().begin() + static_cast<std::ptrdiff_t>(keep), flash.bytes().end(), fill);
      TestStore t(config_for(geometry), flash.flash());
      wrong += t.store.mount() == Status::ok ? 0 : 1;
      const std::size_t right = read_all(t, model, wrong);
      wrong += right + 1 < last ? 1 : 0;
      last = std::max(last, right);
    }
  }
  CHECK(wrong == 0);
  CHECK(last == 10);
}

TEST_CASE("random bytes and hostile records neither crash nor loop") {
  const Geometry geometry{4096, 16, 256};
  Random32 random(11);
  for (int trial = 0; trial < trials(300); ++trial) {
    TornFlash flash(geometry);
    const std::uint32_t kind = random() % 3;
    Bytes& bytes = flash.bytes();
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      bytes[i] = kind == 0 ? static_cast<std::uint8_t>(random()) : (i % 2 == 0 ? 'M' : 'r');
    }
    // Valid block headers and record headers with fields from anywhere.
    for (std::uint32_t block = 0; kind != 0 && block < geometry.block_count; ++block) {
      BlockHeader header;
      const StoreConfig config = config_for(geometry);
      header.side = config.side;
      header.cell_m = config.cell_m;
      header.fingerprint = config.fingerprint;
      header.block_size = geometry.block_size;
      header.block_count = geometry.block_count;
      header.program_unit = geometry.unit;
      header.sequence = 1 + random() % (kind == 1 ? 40U : 0xFFFFFEFFU);
      header.oldest_sequence = 1;
      std::uint8_t* const base = bytes.data() + std::size_t{block} * geometry.block_size;
      encode_block_header(header, Span<std::uint8_t>(base, kBlockHeaderBytes));
      std::size_t at = kBlockHeaderBytes;
      while (at + kRecordHeaderBytes <= geometry.block_size) {
        RecordHeader record;
        record.type = static_cast<RecordType>(1 + random() % 6);
        record.kind = static_cast<std::uint8_t>(record.type == RecordType::blob ? 1 + random() % 2 : 0);
        record.group = 1 + random() % 20;
        record.id = random() % 3;
        record.part = static_cast<std::uint16_t>(random() % 3);
        record.parts = static_cast<std::uint16_t>(random() % 4);
        record.length = static_cast<std::uint16_t>(random() % 4 == 0 ? random() % 3000 : random() % 100);
        record.payload_crc = 0;
        encode_record_header(record, Span<std::uint8_t>(base + at, kRecordHeaderBytes));
        at += kRecordHeaderBytes + random() % 100;
      }
    }
    TestStore t(config_for(geometry), flash.flash());
    const Status mounted = t.store.mount();
    CHECK(mounted != Status::device_error);
    for (std::size_t i = 0; i < t.store.submap_count(); ++i) {
      CHECK(t.fetch(t.store.submap_id(i)) != Status::ok);
      static_cast<void>(t.store.grid_crc32(t.store.submap_id(i)).ok());
    }
    for (std::size_t i = 0; i < t.store.blob_count(1); ++i) {
      Bytes out(5000);
      static_cast<void>(t.store.read_blob(1, t.store.blob_id(1, i), Span<std::uint8_t>(out.data(), out.size())).ok());
    }
    CHECK(flash.violations() == 0);
    CHECK(t.store.format() == Status::ok);
    CHECK(t.store.mount() == Status::ok);
    CHECK(t.store.submap_count() == 0);
  }
}
