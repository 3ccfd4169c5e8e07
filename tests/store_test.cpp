#include <doctest.h>

#include <algorithm>
#include <limits>
#include <string>

#include "mellin/store/crc32.hpp"
#include "store_fixture.hpp"

using namespace mellin;
using namespace mellin::test;

namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes blob_of(const SubmapStore& store, BlobKind kind, std::uint32_t id, std::size_t most = 100'000) {
  Bytes out(most);
  const Result<std::size_t> size = store.read_blob(kind, id, Span<std::uint8_t>(out.data(), out.size()));
  out.resize(size.ok() ? size.value() : 0);
  return out;
}

/// CRC-32 (ISO 3309, as in zlib), bit by bit as the standard has it.
std::uint32_t reference_crc(const std::uint8_t* bytes, std::size_t size, std::uint32_t before = 0) {
  std::uint32_t crc = ~before;
  for (std::size_t i = 0; i < size; ++i) {
    crc ^= bytes[i];
    for (int bit = 0; bit < 8; ++bit) {
      crc = crc >> 1 ^ ((crc & 1U) != 0 ? 0xEDB88320U : 0U);
    }
  }
  return ~crc;
}

/// CRC-32 of the submap as the format defines it: header payload, then cells tile by tile.
std::uint32_t expected_crc(const SubmapHeader& header, const Bytes& cells, std::uint16_t side) {
  Bytes payload(kSubmapPayloadBytes);
  encode_submap(header, Span<std::uint8_t>(payload.data(), payload.size()));
  std::uint32_t crc = reference_crc(payload.data(), payload.size());
  for (std::uint32_t top = 0; top < side; top += kTileSide) {
    for (std::uint32_t left = 0; left < side; left += kTileSide) {
      for (std::uint32_t r = top; r < std::min<std::uint32_t>(top + kTileSide, side); ++r) {
        const std::uint32_t width = std::min<std::uint32_t>(kTileSide, side - left);
        crc = reference_crc(cells.data() + std::size_t{r} * side + left, width, crc);
      }
    }
  }
  return crc;
}

}  // namespace

TEST_CASE("CRC-32 is the standard one") {
  const Bytes bytes = random_bytes(1000, 1);
  CHECK(mellin::crc32(Span<const std::uint8_t>(bytes.data(), bytes.size())) ==
        reference_crc(bytes.data(), bytes.size()));
  const std::uint8_t check[] = {'1', '2', '3', '4', '5', '6', '7', '8', '9'};
  CHECK(mellin::crc32(check) == 0xCBF43926U);  // the polynomial's published check value
}

TEST_CASE("the bytes on flash are those of the table, on every machine") {
  RecordHeader header;
  header.type = RecordType::grid;
  header.group = 0x01020304;
  header.id = 0x11121314;
  header.part = 0x2122;
  header.parts = 3;
  header.length = 5;
  std::uint8_t bytes[kRecordHeaderBytes];
  encode_record_header(header, bytes);
  const std::uint8_t expected[] = {'M', 'r', 2, 0, 4, 3, 2, 1, 0x14, 0x13, 0x12, 0x11, 0x22, 0x21, 3, 0, 5, 0, 0, 0};
  CHECK(std::equal(std::begin(expected), std::end(expected), bytes));
  CHECK(decode_u32(Span<const std::uint8_t>(bytes + 24, 4)) == reference_crc(bytes, 24));

  BlockHeader block;
  block.side = 0x0102;
  block.fingerprint = 0x1112131415161718U;
  block.sequence = 7;
  block.oldest_sequence = 5;
  std::uint8_t block_bytes[kBlockHeaderBytes];
  encode_block_header(block, block_bytes);
  const std::uint8_t begin[] = {'M',  'L',  'N',  'B',  1, 0, 2, 1, 0x18, 0x17, 0x16, 0x15,
                                0x14, 0x13, 0x12, 0x11, 7, 0, 0, 0, 5,    0,    0,    0};
  CHECK(std::equal(std::begin(begin), std::end(begin), block_bytes));
  CHECK(decode_u32(Span<const std::uint8_t>(block_bytes + 52, 4)) == reference_crc(block_bytes, 52));
}

TEST_CASE("submaps and blobs come back bit by bit, over all geometries and after a remount") {
  const Geometry geometries[] = {{4096, 64, 1},   {4096, 64, 4},    {4096, 64, 256},   {4096, 64, 2048},
                                 {8192, 32, 512}, {65536, 8, 1024}, {131072, 8, 2048}, {131072, 8, 16}};
  for (const Geometry& geometry : geometries) {
    CAPTURE(geometry.block_size);
    CAPTURE(geometry.unit);
    StoreConfig config = small_config(80);  // not a multiple of the tile
    config.page_bytes = static_cast<std::uint16_t>(std::max<std::uint32_t>(256, geometry.unit));
    TornFlash flash(geometry);
    std::vector<Bytes> grids = {room_grid(80, 1), random_bytes(6400, 2), Bytes(6400, kUnobserved), Bytes(6400, 0)};
    std::vector<Bytes> blobs = {random_bytes(10'000, 5), {}, random_bytes(1, 6), random_bytes(2020, 7)};
    {
      TestStore t(config, flash.flash());
      REQUIRE(t.init_status == Status::ok);
      CHECK(t.fits_exactly);
      CHECK(t.store.mount() == Status::not_found);
      REQUIRE(t.store.format() == Status::ok);
      for (std::uint32_t i = 0; i < grids.size(); ++i) {
        REQUIRE(t.put(sample_header(i), grids[i], blobs[i]) == Status::ok);
        CHECK(t.cells(i) == grids[i]);
      }
    }
    TestStore t(config, flash.flash());
    REQUIRE(t.store.mount() == Status::ok);
    REQUIRE(t.store.submap_count() == grids.size());
    for (std::uint32_t i = 0; i < grids.size(); ++i) {
      CHECK(t.store.submap_id(i) == i);
      CHECK(t.cells(i) == grids[i]);
      CHECK(blob_of(t.store, 1, i) == blobs[i]);
      const Result<SubmapHeader> header = t.store.header(i);
      REQUIRE(header.ok());
      CHECK(same(header.value(), sample_header(i)));
      const Result<std::uint32_t> crc = t.store.grid_crc32(i);
      REQUIRE(crc.ok());
      CHECK(crc.value() == expected_crc(sample_header(i), grids[i], 80));
    }
    CHECK(flash.violations() == 0);
    CHECK(t.store.statistics().lost_records == 0);
  }
}

TEST_CASE("a newer blob replaces the older one, removal removes, and both survive a remount") {
  TornFlash flash({4096, 32, 64});
  const StoreConfig config = small_config();
  TestStore t(config, flash.flash());
  REQUIRE(t.store.format() == Status::ok);
  const Bytes old_bytes = random_bytes(300, 1);
  const Bytes new_bytes = random_bytes(200, 2);
  REQUIRE(t.put(sample_header(5), room_grid(64, 1), old_bytes) == Status::ok);
  REQUIRE(t.put(sample_header(6), room_grid(64, 2), old_bytes) == Status::ok);
  REQUIRE(t.store.begin_group({0, 3, 200}) == Status::ok);
  REQUIRE(t.store.put_blob(1, 5, Span<const std::uint8_t>(new_bytes.data(), new_bytes.size())) == Status::ok);
  REQUIRE(t.drain() == Status::ok);
  CHECK(blob_of(t.store, 1, 5) == old_bytes);  // not before the commit
  REQUIRE(t.store.remove_blob(1, 6) == Status::ok);
  REQUIRE(t.drain() == Status::ok);
  REQUIRE(t.store.remove_submap(6) == Status::ok);
  REQUIRE(t.drain() == Status::ok);
  REQUIRE(t.store.commit() == Status::ok);
  REQUIRE(t.drain() == Status::ok);
  for (int round = 0; round < 2; ++round) {
    CHECK(blob_of(t.store, 1, 5) == new_bytes);
    CHECK(t.store.blob_count(1) == 1);
    CHECK(t.store.submap_count() == 1);
    CHECK(t.store.begin_fetch(6) == Status::not_found);
    CHECK(t.store.remove_blob(1, 5) == Status::invalid_argument);  // no group
    REQUIRE(t.store.mount() == Status::ok);
  }
}

TEST_CASE("blobs of a kind are visited by ascending id") {
  TornFlash flash({4096, 32, 1});
  TestStore t(small_config(), flash.flash());
  REQUIRE(t.store.format() == Status::ok);
  REQUIRE(t.store.begin_group({0, 4, 16}) == Status::ok);
  const std::uint32_t ids[] = {7, 3, 0xFFFFFFFFU, 5};
  for (const std::uint32_t id : ids) {
    const std::uint8_t bytes[] = {static_cast<std::uint8_t>(id), 1};
    REQUIRE(t.store.put_blob(id == 5 ? 255 : 2, id, bytes) == Status::ok);
    REQUIRE(t.drain() == Status::ok);
  }
  REQUIRE(t.store.commit() == Status::ok);
  REQUIRE(t.drain() == Status::ok);
  std::vector<std::uint32_t> seen;
  std::uint8_t buffer[8];
  const auto visit = [](void* context, std::uint32_t id, Span<const std::uint8_t> bytes) {
    if (bytes.size() == 2 && bytes[0] == static_cast<std::uint8_t>(id)) {
      static_cast<std::vector<std::uint32_t>*>(context)->push_back(id);
    }
  };
  CHECK(t.store.read_blobs(2, buffer, &seen, visit) == Status::ok);
  CHECK(seen == std::vector<std::uint32_t>{3, 7, 0xFFFFFFFFU});
  CHECK(t.store.blob_count(255) == 1);
  CHECK(t.store.read_blobs(2, Span<std::uint8_t>(buffer, 1), &seen, visit) == Status::invalid_argument);
}

TEST_CASE("slots: the least recently used is given up, pinned ones are not, handles do not dangle") {
  TornFlash flash({4096, 64, 256});
  TestStore t(small_config(), flash.flash());
  REQUIRE(t.store.format() == Status::ok);
  for (std::uint32_t i = 0; i < 4; ++i) {
    REQUIRE(t.put(sample_header(i), room_grid(64, i), {}) == Status::ok);
  }
  GridSlots& slots = t.store.slots();
  REQUIRE(t.fetch(0) == Status::ok);
  REQUIRE(t.fetch(1) == Status::ok);
  REQUIRE(t.fetch(0) == Status::ok);
  {
    Result<SlotHandle> use = t.store.slot(0);
    REQUIRE(use.ok());
    REQUIRE(slots.release(use.value()) == Status::ok);
  }
  REQUIRE(t.fetch(2) == Status::ok);
  CHECK(t.store.is_resident(0));
  CHECK_FALSE(t.store.is_resident(1));

  Result<SlotHandle> a = t.store.slot(0);
  Result<SlotHandle> b = t.store.slot(2);
  REQUIRE((a.ok() && b.ok()));
  CHECK(slots.pinned() == 2);
  CHECK(t.store.begin_fetch(3) == Status::busy);
  CHECK(slots.acquire_free().status() == Status::busy);
  REQUIRE(slots.release(a.value()) == Status::ok);
  CHECK(slots.release(a.value()) == Status::invalid_argument);  // twice
  CHECK(slots.view(a.value()).cells.empty());
  REQUIRE(t.fetch(3) == Status::ok);
  CHECK_FALSE(t.store.is_resident(0));
  const GridView kept = slots.view(b.value());
  CHECK(Bytes(kept.cells.begin(), kept.cells.end()) == room_grid(64, 2));
  SlotHandle moved = std::move(b.value());
  CHECK(slots.id(moved) == 2);
  CHECK(slots.release(b.value()) == Status::invalid_argument);  // NOLINT(bugprone-use-after-move): what is tested
  CHECK(slots.release(moved) == Status::ok);
}

TEST_CASE("a submap rendered into a slot is found there after the commit") {
  TornFlash flash({4096, 64, 256});
  for (const bool with_flash : {true, false}) {
    TestStore t(small_config(), with_flash ? flash.flash() : mellin_flash{});
    CHECK(t.store.keeps_data() == with_flash);
    REQUIRE(t.store.format() == Status::ok);
    for (std::uint32_t id = 0; id < 3; ++id) {
      Result<SlotHandle> slot = t.store.slots().acquire_free();
      REQUIRE(slot.ok());
      const Bytes grid = room_grid(64, id);
      std::copy(grid.begin(), grid.end(), t.store.slots().cells(slot.value()).begin());
      REQUIRE(t.store.begin_group({1, 0, 0}) == Status::ok);
      REQUIRE(t.store.put_submap(sample_header(id), slot.value()) == Status::ok);
      REQUIRE(t.store.slots().release(slot.value()) == Status::ok);
      REQUIRE(t.drain() == Status::ok);
      CHECK(t.store.slots().pinned() == 1);  // by the store
      REQUIRE(t.store.commit() == Status::ok);
      REQUIRE(t.drain() == Status::ok);
      CHECK(t.store.slots().pinned() == 0);
      CHECK(t.store.is_resident(id));
      CHECK(t.cells(id) == grid);
    }
    CHECK(t.store.begin_fetch(0) == (with_flash ? Status::ok : Status::not_found));  // evicted by the third
  }
}

TEST_CASE("full is said before anything is written, and what is there stays") {
  TornFlash flash({4096, 16, 256});
  TestStore t(small_config(), flash.flash());
  REQUIRE(t.store.format() == Status::ok);
  std::uint32_t stored = 0;
  Status status = Status::ok;
  while (status == Status::ok) {
    const std::uint64_t before = flash.operations();
    status = t.put(sample_header(stored), random_bytes(4096, stored), {});
    stored += status == Status::ok ? 1U : 0U;
    if (status != Status::ok) {
      CHECK(flash.operations() == before);
    }
  }
  CHECK(status == Status::full);
  CHECK(stored >= 8);  // 4 KiB raw each in 64 KiB
  REQUIRE(t.store.mount() == Status::ok);
  CHECK(t.store.submap_count() == stored);
  for (std::uint32_t i = 0; i < stored; ++i) {
    CHECK(t.cells(i) == random_bytes(4096, i));
  }
  CHECK(flash.violations() == 0);
  // The index's limits, too.
  TornFlash large({4096, 1024, 256});
  StoreConfig config = small_config();
  config.max_submaps = 1;
  TestStore limited(config, large.flash());
  REQUIRE(limited.store.format() == Status::ok);
  REQUIRE(limited.put(sample_header(0), room_grid(64, 0), {}) == Status::ok);
  CHECK(limited.put(sample_header(1), room_grid(64, 1), {}) == Status::full);
  limited.store.abandon_group();
  CHECK(limited.put(sample_header(0), room_grid(64, 2), {}) == Status::ok);  // replacing needs no room
  CHECK(limited.cells(0) == room_grid(64, 2));
}

TEST_CASE("random grids never take more blocks than the worst case says") {
  for (const std::uint32_t block_size : {4096U, 16384U, 131072U}) {
    TornFlash flash({block_size, (2U << 20U) / block_size, 256});
    TestStore t(small_config(256), flash.flash());
    REQUIRE(t.store.format() == Status::ok);
    const std::uint64_t before = t.store.statistics().free_bytes / (block_size - kBlockHeaderBytes);
    Bytes grid = random_bytes(65536, 9);
    for (std::size_t i = 0; i < grid.size(); i += 3) {
      grid[i] = 0;  // close to the limit between coded and raw
    }
    REQUIRE(t.put(sample_header(0), grid, {}) == Status::ok);
    CHECK(t.cells(0) == grid);
    const std::uint64_t after = t.store.statistics().free_bytes / (block_size - kBlockHeaderBytes);
    CHECK(before - after <=
          SubmapWriter::worst_case_blocks(256, block_size - static_cast<std::uint32_t>(kBlockHeaderBytes)) + 1);
  }
}

TEST_CASE("another fingerprint or version is refused and named, and formatting takes over") {
  TornFlash flash({4096, 16, 256});
  std::vector<std::string> lines;
  const mellin_log log = {&lines, [](void* context, mellin_log_level, const char* line) {
                            static_cast<std::vector<std::string>*>(context)->emplace_back(line);
                          }};
  StoreConfig config = small_config();
  config.fingerprint = 1111;
  {
    TestStore t(config, flash.flash());
    REQUIRE(t.store.format() == Status::ok);
    REQUIRE(t.put(sample_header(0), room_grid(64, 0), {}) == Status::ok);
  }
  config.fingerprint = 2222;
  TestStore t(config, flash.flash(), log);
  CHECK(t.store.mount() == Status::version_mismatch);
  REQUIRE(lines.size() == 1);
  CHECK(lines[0].find("1111") != std::string::npos);
  CHECK(lines[0].find("2222") != std::string::npos);
  CHECK(t.store.begin_group({0, 0, 0}) == Status::not_found);
  REQUIRE(t.store.format() == Status::ok);
  REQUIRE(t.store.mount() == Status::ok);
  CHECK(t.store.submap_count() == 0);

  BlockHeader header;
  header.version = 2;
  header.sequence = 100;
  header.oldest_sequence = 100;
  encode_block_header(header, Span<std::uint8_t>(flash.bytes().data() + 4096 * 9, kBlockHeaderBytes));
  CHECK(t.store.mount() == Status::version_mismatch);
}

TEST_CASE("geometries that contradict themselves are refused") {
  TornFlash flash({4096, 16, 256});
  mellin_flash bad = flash.flash();
  bad.program_unit = 3;
  CHECK(TestStore(small_config(), bad).init_status == Status::invalid_config);
  bad = flash.flash();
  bad.block_size = 2048;
  CHECK(TestStore(small_config(), bad).init_status == Status::invalid_config);
  bad = flash.flash();
  bad.program_unit = 512;  // larger than the page
  CHECK(TestStore(small_config(), bad).init_status == Status::invalid_config);
  bad = flash.flash();
  bad.read = nullptr;
  CHECK(TestStore(small_config(), bad).init_status == Status::invalid_config);
  CHECK(TestStore(small_config(63), flash.flash()).init_status == Status::invalid_config);
  StoreConfig config = small_config();
  config.cell_m = std::numeric_limits<float>::quiet_NaN();
  CHECK(TestStore(config, flash.flash()).init_status == Status::invalid_config);
}

TEST_CASE("one byte less of memory is refused by the arena") {
  const StoreConfig config = small_config();
  MeasureArena measure;
  static_cast<void>(SubmapStore::carve(measure, config));
  const std::size_t bytes = measure.use().total();
  CHECK(measure.use().by_part[static_cast<std::size_t>(Part::store)] == bytes);
  std::vector<std::uint64_t> memory(bytes / 8);
  Arena arena(Span<std::byte>(reinterpret_cast<std::byte*>(memory.data()), bytes - 1));
  static_cast<void>(SubmapStore::carve(arena, config));
  CHECK_FALSE(arena.ok());
}

TEST_CASE("invalid puts are refused") {
  TornFlash flash({4096, 64, 256});
  TestStore t(small_config(), flash.flash());
  REQUIRE(t.store.format() == Status::ok);
  const Bytes cells(4096, 0);
  const GridView grid{Span<const std::uint8_t>(cells.data(), cells.size()), 64, 0.05F};
  CHECK(t.store.put_submap(sample_header(1), grid) == Status::invalid_argument);  // no group
  REQUIRE(t.store.begin_group({1, 1, 10}) == Status::ok);
  CHECK(t.store.begin_group({1, 1, 10}) == Status::busy);
  SubmapHeader header = sample_header(1);
  header.session_T_submap.x = std::numeric_limits<double>::quiet_NaN();
  CHECK(t.store.put_submap(header, grid) == Status::invalid_argument);
  const GridView small{Span<const std::uint8_t>(cells.data(), 1024), 32, 0.05F};
  CHECK(t.store.put_submap(sample_header(1), small) == Status::invalid_argument);
  CHECK(t.store.put_submap(sample_header(1), SlotHandle()) == Status::invalid_argument);
  CHECK(t.store.put_blob(0, 1, {}) == Status::invalid_argument);
  REQUIRE(t.store.put_submap(sample_header(1), grid) == Status::ok);
  CHECK(t.store.put_blob(1, 1, {}) == Status::busy);
  CHECK(t.store.commit() == Status::busy);
  t.store.abandon_group();
  REQUIRE(t.store.mount() == Status::ok);
  CHECK(t.store.submap_count() == 0);
}
