#include "host/line_reader.hpp"

#include <zlib.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace mellin::host {

struct LineReader::Stream {
  gzFile file = nullptr;

  explicit Stream(gzFile opened) : file(opened) {}
  ~Stream() { gzclose_r(file); }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;
};

LineReader::LineReader(std::string path) : path_(std::move(path)), buffer_(std::size_t{1} << 16U) {
  gzFile file = gzopen(path_.c_str(), "rb");
  if (file == nullptr) {
    throw std::runtime_error(path_ + ": expected a readable file, found none");
  }
  stream_ = std::make_unique<Stream>(file);
}

LineReader::~LineReader() = default;

bool LineReader::fill() {
  const int count = gzread(stream_->file, buffer_.data(), static_cast<unsigned>(buffer_.size()));
  int error = Z_OK;
  const char* text = gzerror(stream_->file, &error);
  // A gzip file that ends early gives its data first and Z_BUF_ERROR with them.
  if (count < 0 || (error != Z_OK && error != Z_STREAM_END)) {
    throw std::runtime_error(
        path_ + ":" + std::to_string(number_ + 1) +
        ": expected text or gzip data to the end, found: " + (error == Z_ERRNO ? "a read error" : text));
  }
  begin_ = 0;
  end_ = static_cast<std::size_t>(count);
  return count > 0;
}

bool LineReader::next(std::string& line) {
  line.clear();
  overlong_ = false;
  bool any = false;
  while (begin_ < end_ || fill()) {
    any = true;
    const char* from = buffer_.data() + begin_;
    const char* to = buffer_.data() + end_;
    const char* newline = std::find(from, to, '\n');
    const auto length = static_cast<std::size_t>(newline - from);
    const std::size_t kept = std::min(length, kMaxLineBytes - line.size());
    line.append(from, kept);
    overlong_ = overlong_ || kept < length;
    begin_ += length;
    if (newline != to) {
      ++begin_;
      break;
    }
  }
  if (any) {
    ++number_;
  }
  return any;
}

void split_words(std::string_view line, std::vector<std::string_view>& words) {
  constexpr std::string_view kBlanks = " \t\r\n\v\f";
  words.clear();
  std::size_t from = line.find_first_not_of(kBlanks);
  while (from != std::string_view::npos) {
    const std::size_t to = std::min(line.find_first_of(kBlanks, from), line.size());
    words.push_back(line.substr(from, to - from));
    from = line.find_first_not_of(kBlanks, to);
  }
}

bool parse_number(std::string_view word, double& value) {
  const char* end = word.data() + word.size();
  const std::from_chars_result result = std::from_chars(word.data(), end, value);
  return result.ec == std::errc() && result.ptr == end && std::isfinite(value);
}

}  // namespace mellin::host
