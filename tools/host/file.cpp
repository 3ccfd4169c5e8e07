#include "host/file.hpp"

#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <system_error>

namespace mellin::host {

void write_file(const std::string& path, std::string_view bytes) {
  const std::string beside = path + ".part";
  std::FILE* out = std::fopen(beside.c_str(), "wb");
  if (out == nullptr) {
    throw std::runtime_error(path + ": expected a file that can be written, found none (" + beside + ")");
  }
  const bool written = bytes.empty() || std::fwrite(bytes.data(), 1, bytes.size(), out) == bytes.size();
  const bool closed = std::fclose(out) == 0;
  std::error_code error;
  if (written && closed) {
    std::filesystem::rename(beside, path, error);
  }
  if (!written || !closed || error) {
    std::error_code ignored;
    std::filesystem::remove(beside, ignored);
    throw std::runtime_error(path + ": cannot be written" + (error ? ": " + error.message() : ""));
  }
}

std::string escape_html(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string csv_field(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) {
    return std::string(text);
  }
  std::string out = "\"";
  for (const char c : text) {
    out += c;
    if (c == '"') {
      out += c;
    }
  }
  return out + "\"";
}

}  // namespace mellin::host
