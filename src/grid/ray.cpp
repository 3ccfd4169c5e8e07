#include "mellin/grid/ray.hpp"

namespace mellin {

CellRect intersection(const CellRect& a, const CellRect& b) {
  return {a.column_min > b.column_min ? a.column_min : b.column_min, a.row_min > b.row_min ? a.row_min : b.row_min,
          a.column_end < b.column_end ? a.column_end : b.column_end, a.row_end < b.row_end ? a.row_end : b.row_end};
}

}  // namespace mellin
