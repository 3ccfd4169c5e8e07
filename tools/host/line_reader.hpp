// Lines of a text file, plain or gzip, without trust in its size.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace mellin::host {

class LineReader {
 public:
  /// Throws std::runtime_error where the file cannot be opened.
  explicit LineReader(std::string path);
  ~LineReader();
  LineReader(const LineReader&) = delete;
  LineReader& operator=(const LineReader&) = delete;

  /// Reads the next line without its end; false at the end of the file. Of a line over kMaxLineBytes only that much is
  /// kept, and overlong() says so. Throws std::runtime_error naming file and line where reading fails.
  bool next(std::string& line);

  std::size_t number() const { return number_; }  ///< of the line read last, from 1
  bool overlong() const { return overlong_; }

  static constexpr std::size_t kMaxLineBytes = std::size_t{1} << 20U;

 private:
  struct Stream;
  bool fill();

  std::string path_;
  std::unique_ptr<Stream> stream_;
  std::vector<char> buffer_;
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
  std::size_t number_ = 0;
  bool overlong_ = false;
};

/// The words of a line, between blanks.
void split_words(std::string_view line, std::vector<std::string_view>& words);

/// The whole word as a finite number; false where it is not one.
bool parse_number(std::string_view word, double& value);

}  // namespace mellin::host
