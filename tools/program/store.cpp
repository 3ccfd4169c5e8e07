// mellin store: what a flash image holds, whether it is intact, and its submaps as pictures.
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "host/image_store.hpp"
#include "program/commands.hpp"

namespace mellin::program {
namespace {

constexpr int kKinds = 256;

struct StoreOptions {
  std::string image;
  std::string against;
  std::string out;
};

void print_info(const StoreOptions& options) {
  host::ImageStore image(options.image);
  const posix::ImageInfo& info = image.info();
  const StoreStatistics s = image.store().statistics();
  std::printf("format version    %u\n", unsigned{info.newest.version});
  std::printf("fingerprint       %016llx\n", static_cast<unsigned long long>(info.newest.fingerprint));
  std::printf("grids             %u x %u cells of %g m\n", unsigned{info.newest.side}, unsigned{info.newest.side},
              static_cast<double>(info.newest.cell_m));
  std::printf("flash             %u blocks of %u bytes, program unit %u\n", info.geometry.block_count,
              info.geometry.block_size, info.geometry.program_unit);
  std::printf("submaps           %u\n", s.submaps);
  for (int kind = 1; kind < kKinds; ++kind) {
    const std::size_t count = image.store().blob_count(static_cast<BlobKind>(kind));
    if (count > 0) {
      std::printf("blobs of kind %-3d %zu\n", kind, count);
    }
  }
  std::printf("logical bytes     %llu\n", static_cast<unsigned long long>(s.logical_bytes));
  std::printf("free bytes        %llu\n", static_cast<unsigned long long>(s.free_bytes));
  std::printf("erases            %llu, at most %u of a block\n", static_cast<unsigned long long>(s.erases),
              s.max_block_erases);
  std::printf("damage            %u records, %u blocks\n", s.lost_records, s.damaged_blocks);
}

/// Reads every submap and blob; returns a line for each fault.
std::vector<std::string> find_faults(host::ImageStore& image) {
  std::vector<std::string> faults;
  SubmapStore& store = image.store();
  const StoreStatistics s = store.statistics();
  if (s.lost_records > 0 || s.damaged_blocks > 0) {
    faults.push_back(std::to_string(s.lost_records) + " records missing, " + std::to_string(s.damaged_blocks) +
                     " blocks damaged");
  }
  for (std::size_t i = 0; i < store.submap_count(); ++i) {
    const SubmapId id = store.submap_id(i);
    if (image.fetch(id).empty()) {
      faults.push_back("submap " + std::to_string(id) + " is damaged");
    }
  }
  std::vector<std::uint8_t> bytes;
  for (int kind = 1; kind < kKinds; ++kind) {
    const auto blob_kind = static_cast<BlobKind>(kind);
    for (std::size_t i = 0; i < store.blob_count(blob_kind); ++i) {
      const std::uint32_t id = store.blob_id(blob_kind, i);
      if (const Status status = image.read_blob(blob_kind, id, bytes); status != Status::ok) {
        faults.push_back("blob " + std::to_string(id) + " of kind " + std::to_string(kind) + ": " + to_string(status));
      }
    }
  }
  return faults;
}

/// A line for each submap of the list that is not in the store as it should be.
std::vector<std::string> compare(const SubmapStore& store, const std::vector<host::StoredLine>& list) {
  std::vector<std::string> faults;
  for (const host::StoredLine& line : list) {
    const Result<std::uint32_t> crc = store.grid_crc32(line.id);
    if (crc.status() == Status::not_found) {
      faults.push_back("submap " + std::to_string(line.id) + " is missing");
    } else if (!crc.ok()) {
      faults.push_back("submap " + std::to_string(line.id) + ": " + to_string(crc.status()));
    } else if (crc.value() != line.crc32) {
      faults.push_back("submap: expected " + to_string(line) + ", found " +
                       to_string(host::StoredLine{line.id, crc.value()}));
    }
  }
  return faults;
}

void verify(const StoreOptions& options) {
  std::vector<host::StoredLine> list;
  if (!options.against.empty()) {
    list = host::read_stored(options.against);
  }
  host::ImageStore image(options.image);
  std::vector<std::string> faults = find_faults(image);
  const std::vector<std::string> missing = compare(image.store(), list);
  faults.insert(faults.end(), missing.begin(), missing.end());
  for (const std::string& fault : faults) {
    std::printf("%s\n", fault.c_str());
  }
  if (!faults.empty()) {
    throw std::runtime_error(options.image + ": " + std::to_string(faults.size()) + " faults, the first: " + faults[0]);
  }
  std::printf("%zu submaps intact, %zu of the list found\n", image.store().submap_count(), list.size());
}

/// A picture as map_server means it: dark occupied, light free, 205 unobserved; y up.
void write_pgm(const std::filesystem::path& path, const std::vector<std::uint8_t>& cells, std::size_t side) {
  constexpr std::uint8_t kGrey = 205;
  std::ofstream out(path, std::ios::binary);
  out << "P5\n" << side << ' ' << side << "\n255\n";
  std::vector<char> line(side);
  for (std::size_t row = side; row-- > 0;) {
    for (std::size_t column = 0; column < side; ++column) {
      const std::uint8_t cell = cells[row * side + column];
      const auto light = static_cast<std::uint8_t>(kCertainlyOccupied - cell);
      const auto seen = static_cast<std::uint8_t>(light == kGrey ? kGrey + 1 : light);
      line[column] = static_cast<char>(cell == kUnobserved ? kGrey : seen);
    }
    out.write(line.data(), static_cast<std::streamsize>(line.size()));
  }
  out.flush();
  if (!out) {
    throw std::runtime_error(path.string() + ": cannot be written");
  }
}

std::string csv_row(const SubmapHeader& h, std::uint32_t bytes, std::uint32_t crc) {
  std::string session;
  std::array<char, 400> text{};
  for (const std::uint8_t byte : h.session.bytes) {
    static_cast<void>(std::snprintf(text.data(), text.size(), "%02x", unsigned{byte}));
    session += text.data();
  }
  static_cast<void>(std::snprintf(
      text.data(), text.size(), "%u,%s,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%lld,%u,%u,%u,%08x\n", h.id, session.c_str(),
      h.session_T_submap.x, h.session_T_submap.y, h.session_T_submap.theta, h.submap_T_robot.x, h.submap_T_robot.y,
      h.submap_T_robot.theta, static_cast<long long>(h.stamp_us), h.first_scan, h.scan_count, bytes, crc));
  return text.data();
}

void dump(const StoreOptions& options) {
  host::ImageStore image(options.image);
  SubmapStore& store = image.store();
  std::filesystem::create_directories(options.out);
  const std::filesystem::path folder = options.out;
  std::ofstream csv(folder / "submaps.csv");
  csv << "id,session,x,y,theta,robot_x,robot_y,robot_theta,stamp_us,first_scan,scan_count,bytes,crc32\n";
  std::size_t damaged = 0;
  for (std::size_t i = 0; i < store.submap_count(); ++i) {
    const SubmapId id = store.submap_id(i);
    const Result<SubmapHeader> header = store.header(id);
    const Result<std::uint32_t> crc = store.grid_crc32(id);
    const std::vector<std::uint8_t> cells = image.fetch(id);
    if (!header.ok() || !crc.ok() || cells.empty()) {
      ++damaged;
      continue;
    }
    csv << csv_row(header.value(), store.stored_bytes(id), crc.value());
    write_pgm(folder / ("submap-" + std::to_string(id) + ".pgm"), cells, image.info().newest.side);
  }
  csv.flush();
  if (!csv) {
    throw std::runtime_error((folder / "submaps.csv").string() + ": cannot be written");
  }
  if (damaged > 0) {
    throw std::runtime_error(options.image + ": " + std::to_string(damaged) + " submaps are damaged and left out");
  }
}

}  // namespace

void add_store(CLI::App& app) {
  CLI::App* const store = app.add_subcommand("store", "looks into a flash image");
  store->require_subcommand(1);
  const auto options = std::make_shared<StoreOptions>();
  const auto add = [&](const char* name, const char* what, void (*run)(const StoreOptions&)) {
    CLI::App* const command = store->add_subcommand(name, what);
    command->add_option("IMAGE", options->image, "flash image")->required();
    command->callback([options, run] { run(*options); });
    return command;
  };
  add("info", "what it holds and how worn it is", print_info);
  add("verify", "reads everything; fails where anything is damaged or missing", verify)
      ->add_option("--against", options->against, "a stored.log: what has to be there");
  add("dump", "writes each submap as PGM and a CSV of their headers", dump)
      ->add_option("-o,--output", options->out, "folder to write into")
      ->required();
}

}  // namespace mellin::program
