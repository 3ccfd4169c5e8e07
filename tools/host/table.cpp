#include "host/table.hpp"

#include <algorithm>
#include <cstdio>
#include <stdexcept>

#include "host/file.hpp"

namespace mellin::host {

void Table::add(std::vector<std::string> row) {
  if (row.size() != columns_.size()) {
    throw std::invalid_argument("a row has as many cells as the table has columns");
  }
  rows_.push_back(std::move(row));
}

std::string Table::csv() const {
  std::string out;
  const auto write = [&out](const std::vector<std::string>& row) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      out += i == 0 ? "" : ",";
      out += csv_field(row[i]);
    }
    out += "\n";
  };
  write(columns_);
  for (const std::vector<std::string>& row : rows_) {
    write(row);
  }
  return out;
}

std::string Table::text() const {
  std::vector<std::size_t> widths;
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    std::size_t width = columns_[i].size();
    for (const std::vector<std::string>& row : rows_) {
      width = std::max(width, row[i].size());
    }
    widths.push_back(width);
  }
  std::string out;
  const auto write = [&](const std::vector<std::string>& row) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      out += row[i];
      out += i + 1 < row.size() ? std::string(widths[i] - row[i].size() + 2, ' ') : "\n";
    }
  };
  write(columns_);
  for (const std::vector<std::string>& row : rows_) {
    write(row);
  }
  return out;
}

std::string fixed(double value, int digits) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

}  // namespace mellin::host
