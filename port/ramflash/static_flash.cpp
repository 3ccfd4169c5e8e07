#include "ramflash/static_flash.hpp"

#include "ramflash/flash_model.hpp"

namespace mellin::port {
namespace {

constexpr FlashGeometry kGeometry{4096, 64, 256};

__attribute__((section(".bulk"))) std::uint8_t bytes[kGeometry.bytes()];  // not cleared by the start-up

}  // namespace

mellin_flash static_flash() {
  static FlashModel model(kGeometry, Span<std::uint8_t>(bytes, sizeof bytes));
  static bool erased = false;
  if (!erased) {
    model.erase_all();
    erased = true;
  }
  return model.flash();
}

}  // namespace mellin::port
