#include "ramflash/flash_model.hpp"

#include <cstring>

namespace mellin::port {
namespace {

constexpr int kRefused = -1;

}  // namespace

mellin_flash describe(void* context, const FlashGeometry& geometry) {
  mellin_flash flash{};
  flash.context = context;
  flash.block_size = geometry.block_size;
  flash.block_count = geometry.block_count;
  flash.program_unit = geometry.program_unit;
  flash.erased_value = kErasedByte;
  return flash;
}

bool is_erased(Span<const std::uint8_t> bytes) {
  for (const std::uint8_t byte : bytes) {
    if (byte != kErasedByte) {
      return false;
    }
  }
  return true;
}

void FlashModel::erase_all() { std::memset(bytes_.data(), kErasedByte, bytes_.size()); }

mellin_flash FlashModel::flash() {
  mellin_flash flash = describe(this, geometry_);
  flash.read = read;
  flash.program = program;
  flash.erase = erase;
  flash.sync = sync;
  return flash;
}

int FlashModel::read(void* context, std::uint32_t address, void* buffer, std::uint32_t size) {
  const auto& self = *static_cast<const FlashModel*>(context);
  if (!self.geometry_.inside(address, size)) {
    return kRefused;
  }
  std::memcpy(buffer, self.bytes_.data() + address, size);
  return 0;
}

int FlashModel::program(void* context, std::uint32_t address, const void* data, std::uint32_t size) {
  auto& self = *static_cast<FlashModel*>(context);
  if (!self.geometry_.programmable(address, size) || !is_erased(self.bytes_.subspan(address, size))) {
    return kRefused;
  }
  ++self.counts_.programs;
  self.counts_.programmed_bytes += size;
  std::memcpy(self.bytes_.data() + address, data, size);
  return 0;
}

int FlashModel::erase(void* context, std::uint32_t block) {
  auto& self = *static_cast<FlashModel*>(context);
  if (block >= self.geometry_.block_count) {
    return kRefused;
  }
  ++self.counts_.erases;
  std::memset(self.bytes_.data() + std::size_t{block} * self.geometry_.block_size, kErasedByte,
              self.geometry_.block_size);
  return 0;
}

int FlashModel::sync(void* context) {
  ++static_cast<FlashModel*>(context)->counts_.syncs;
  return 0;
}

}  // namespace mellin::port
