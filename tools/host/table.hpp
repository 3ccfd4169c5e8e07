// A table of results: printed in columns, and as CSV.
#pragma once

#include <string>
#include <vector>

namespace mellin::host {

class Table {
 public:
  explicit Table(std::vector<std::string> columns) : columns_(std::move(columns)) {}
  /// Throws std::invalid_argument where the row has another number of cells than there are columns.
  void add(std::vector<std::string> row);
  std::size_t rows() const { return rows_.size(); }
  std::string csv() const;
  /// Columns as wide as they need to be, two spaces between them.
  std::string text() const;

 private:
  std::vector<std::string> columns_;
  std::vector<std::vector<std::string>> rows_;
};

/// With so many digits behind the point.
std::string fixed(double value, int digits = 3);

}  // namespace mellin::host
