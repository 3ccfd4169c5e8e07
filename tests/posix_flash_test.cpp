#include <doctest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include "host/image_store.hpp"
#include "posix/entropy.hpp"
#include "posix/flash_image.hpp"
#include "ramflash/heap_flash.hpp"
#include "store_fixture.hpp"

using namespace mellin;
using namespace mellin::posix;

namespace {

namespace fs = std::filesystem;

/// A folder of its own that goes with the test.
class Folder {
 public:
  Folder() {
    std::string name = (fs::temp_directory_path() / "mellin-flash-XXXXXX").string();
    path_ = ::mkdtemp(name.data());
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  std::string file(const char* name) const { return (path_ / name).string(); }

 private:
  fs::path path_;
};

constexpr FlashGeometry kGeometry{4096, 64, 256};

void check_rules(const mellin_flash& flash, const FlashCounts& counts) {
  std::vector<std::uint8_t> data(512, 0x5A);
  std::vector<std::uint8_t> back(512);
  REQUIRE(flash.read(flash.context, 4096, back.data(), 512) == 0);
  CHECK(back == std::vector<std::uint8_t>(512, 0xFF));
  CHECK(flash.program(flash.context, 100, data.data(), 256) != 0);     // unaligned
  CHECK(flash.program(flash.context, 0, data.data(), 100) != 0);       // not whole units
  CHECK(flash.program(flash.context, 262144, data.data(), 256) != 0);  // outside
  CHECK(flash.read(flash.context, 262143, back.data(), 2) != 0);
  CHECK(flash.erase(flash.context, 64) != 0);
  CHECK(counts.programs == 0);
  REQUIRE(flash.program(flash.context, 4096, data.data(), 512) == 0);
  CHECK(flash.program(flash.context, 4096 + 256, data.data(), 256) != 0);  // not erased
  REQUIRE(flash.read(flash.context, 4096, back.data(), 512) == 0);
  CHECK(back == data);
  REQUIRE(flash.erase(flash.context, 1) == 0);
  REQUIRE(flash.program(flash.context, 4096 + 256, data.data(), 256) == 0);
  REQUIRE(flash.sync(flash.context) == 0);
  CHECK(counts.programs == 2);
  CHECK(counts.programmed_bytes == 768);
  CHECK(counts.erases == 1);
  CHECK(counts.syncs == 1);
}

/// Stores three submaps in an image; returns the lines that stored.log would hold.
std::vector<host::StoredLine> write_image(const std::string& path) {
  FlashImage image(path, kGeometry);
  test::TestStore t(test::small_config(), image.flash());
  REQUIRE(t.store.format() == Status::ok);
  std::vector<host::StoredLine> lines;
  for (SubmapId id = 0; id < 3; ++id) {
    REQUIRE(t.put(test::sample_header(id), test::room_grid(64, id), test::random_bytes(9000, id)) == Status::ok);
    lines.push_back({id, t.store.grid_crc32(id).value()});
  }
  CHECK(t.store.statistics().programmed_bytes == image.counts().programmed_bytes);
  CHECK(t.store.statistics().erases == image.counts().erases);
  return lines;
}

int run_program(const std::string& arguments) {
  const fs::path program = fs::read_symlink("/proc/self/exe").parent_path() / "mellin";
  const int status = std::system(
      (program.string() + " " + arguments + " >/dev/null 2>&1").c_str());  // NOLINT(cert-env33-c): what is tested
  return WEXITSTATUS(status);
}

}  // namespace

TEST_CASE("the image file and the one in memory keep the rules of flash") {
  const Folder folder;
  {
    FlashImage image(folder.file("a.img"), kGeometry);
    CHECK(image.created());
    check_rules(image.flash(), image.counts());
  }
  CHECK(fs::file_size(folder.file("a.img")) == 262144);
  port::HeapFlash ram(kGeometry);
  check_rules(ram.flash(), ram.counts());
}

TEST_CASE("an image of another size is refused and left alone") {
  const Folder folder;
  std::ofstream(folder.file("b.img")) << "something else";
  CHECK_THROWS_AS(FlashImage(folder.file("b.img"), kGeometry), std::runtime_error);
  CHECK(fs::file_size(folder.file("b.img")) == 14);
  CHECK_THROWS_AS(FlashImage(folder.file("c.img"), FlashGeometry{4096, 1, 256}), std::runtime_error);
  CHECK_THROWS_AS(FlashImage(folder.file("none.img"), kGeometry, true), std::runtime_error);
  CHECK_THROWS_AS(probe_image(folder.file("b.img")), std::runtime_error);
}

TEST_CASE("an image outlives its program and is opened by what its blocks tell") {
  const Folder folder;
  write_image(folder.file("d.img"));
  host::ImageStore image(folder.file("d.img"));
  CHECK(image.info().geometry.block_count == 64);
  REQUIRE(image.store().submap_count() == 3);
  CHECK(image.fetch(1) == test::room_grid(64, 1));
  std::vector<std::uint8_t> blob;
  CHECK(image.read_blob(1, 2, blob) == Status::ok);
  CHECK(blob == test::random_bytes(9000, 2));
  CHECK(image.store().format() == Status::device_error);  // read-only
}

TEST_CASE("store verify tells intact from damaged and missing by its exit status") {
  const Folder folder;
  const std::string path = folder.file("e.img");
  const std::string list = folder.file("stored.log");
  const std::vector<host::StoredLine> lines = write_image(path);
  {
    std::ofstream out(list);
    for (const host::StoredLine& line : lines) {
      out << host::to_string(line) << '\n';
    }
    out << "3 0123";  // a torn line
  }
  CHECK(run_program("store info " + path) == 0);
  CHECK(run_program("store verify " + path + " --against " + list) == 0);
  CHECK(run_program("store dump " + path + " -o " + folder.file("dump")) == 0);
  CHECK(fs::file_size(folder.file("dump/submap-2.pgm")) == 13 + 64 * 64);
  CHECK(run_program("store verify") == 2);
  CHECK(run_program("store verify " + list) == 1);

  std::ofstream(folder.file("more.log")) << "7 00000000\n";
  CHECK(run_program("store verify " + path + " --against " + folder.file("more.log")) == 1);
  std::ofstream(folder.file("other.log")) << host::to_string({1, lines[1].crc32 ^ 1U}) << '\n';
  CHECK(run_program("store verify " + path + " --against " + folder.file("other.log")) == 1);
  std::ofstream(folder.file("bad.log")) << "x\n1 00000000\n";
  CHECK(run_program("store verify " + path + " --against " + folder.file("bad.log")) == 1);

  std::fstream image(path, std::ios::in | std::ios::out | std::ios::binary);
  image.seekg(kBlockHeaderBytes + kRecordHeaderBytes + 4096 + 100);
  const int byte = image.get();
  image.seekp(kBlockHeaderBytes + kRecordHeaderBytes + 4096 + 100);
  image.put(static_cast<char>(byte ^ 4));
  image.close();
  CHECK(run_program("store verify " + path) == 1);
}

TEST_CASE("the system's entropy fills the buffer, differently each time") {
  const mellin_entropy entropy = system_entropy();
  std::uint8_t a[32] = {};
  std::uint8_t b[32] = {};
  REQUIRE(entropy.fill(entropy.context, a, sizeof a) == 0);
  REQUIRE(entropy.fill(entropy.context, b, sizeof b) == 0);
  CHECK_FALSE(std::equal(std::begin(a), std::end(a), std::begin(b)));
}
