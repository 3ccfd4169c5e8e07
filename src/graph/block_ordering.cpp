#include <algorithm>
#include <cassert>

#include "mellin/graph/block_cholesky.hpp"

namespace mellin {
namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFFU;
/// In place of an element's size: its variables all lie in a later element.
constexpr std::uint32_t kAbsorbed = 0xFFFFFFFFU;

}  // namespace

Status BlockOrdering::init(const BlockCholeskyLimits& limits, const Memory& memory) {
  const std::size_t n = limits.variables;
  bool good = memory.begin.size() > n && memory.list_begin.size() > n && memory.rows.size() >= limits.fill &&
              memory.slots.size() >= limits.pairs &&
              memory.neighbours.size() >= 2 * static_cast<std::size_t>(limits.pairs);
  for (const Span<std::uint32_t>& each :
       {memory.position, memory.variable, memory.variables_in, memory.elements_in, memory.degree, memory.head,
        memory.next, memory.previous, memory.mark, memory.outside, memory.stamp}) {
    good = good && each.size() >= n;
  }
  if (!good) {
    return Status::insufficient_memory;
  }
  memory_ = memory;
  limits_ = limits;
  phase_ = Phase::idle;
  count_ = used_ = 0;
  return Status::ok;
}

Status BlockOrdering::begin(std::uint32_t variables, Span<const BlockPair> pairs) {
  phase_ = Phase::idle;
  if (variables > limits_.variables || pairs.size() > limits_.pairs) {
    return Status::invalid_argument;
  }
  for (const BlockPair& pair : pairs) {
    if (pair.a != pair.b && (pair.a >= variables || pair.b >= variables)) {
      return Status::invalid_argument;
    }
  }
  count_ = variables;
  pairs_ = pairs;
  used_ = cursor_ = minimum_ = tag_ = 0;
  for (std::uint32_t i = 0; i < count_; ++i) {
    memory_.head[i] = kNone;
    memory_.mark[i] = 0;
    memory_.stamp[i] = 0;
    memory_.elements_in[i] = 0;
    memory_.variables_in[i] = 0;
    memory_.position[i] = kNone;
  }
  build_lists(pairs);
  for (std::uint32_t i = count_; i-- > 0;) {
    enqueue(i);
  }
  phase_ = Phase::eliminate;
  return Status::ok;
}

/// The neighbours of each variable, each once.
void BlockOrdering::build_lists(Span<const BlockPair> pairs) {
  for (const BlockPair& pair : pairs) {
    if (pair.a != pair.b) {
      ++memory_.variables_in[pair.a];
      ++memory_.variables_in[pair.b];
    }
  }
  memory_.list_begin[0] = 0;
  for (std::uint32_t i = 0; i < count_; ++i) {
    memory_.list_begin[i + 1] = memory_.list_begin[i] + memory_.variables_in[i];
    memory_.variables_in[i] = 0;
  }
  for (const BlockPair& pair : pairs) {
    if (pair.a != pair.b) {
      memory_.neighbours[memory_.list_begin[pair.a] + memory_.variables_in[pair.a]++] = pair.b;
      memory_.neighbours[memory_.list_begin[pair.b] + memory_.variables_in[pair.b]++] = pair.a;
    }
  }
  for (std::uint32_t i = 0; i < count_; ++i) {
    ++tag_;
    const std::uint32_t first = memory_.list_begin[i];
    std::uint32_t kept = 0;
    for (std::uint32_t k = 0; k < memory_.variables_in[i]; ++k) {
      const std::uint32_t other = memory_.neighbours[first + k];
      if (memory_.mark[other] != tag_) {
        memory_.mark[other] = tag_;
        memory_.neighbours[first + kept++] = other;
      }
    }
    memory_.variables_in[i] = kept;
    memory_.degree[i] = kept;
  }
}

void BlockOrdering::enqueue(std::uint32_t variable) {
  const std::uint32_t degree = memory_.degree[variable];
  const std::uint32_t old_head = memory_.head[degree];
  memory_.next[variable] = old_head;
  memory_.previous[variable] = kNone;
  if (old_head != kNone) {
    memory_.previous[old_head] = variable;
  }
  memory_.head[degree] = variable;
  minimum_ = std::min(minimum_, degree);
}

void BlockOrdering::dequeue(std::uint32_t variable) {
  const std::uint32_t before = memory_.previous[variable];
  const std::uint32_t after = memory_.next[variable];
  if (before == kNone) {
    memory_.head[memory_.degree[variable]] = after;
  } else {
    memory_.next[before] = after;
  }
  if (after != kNone) {
    memory_.previous[after] = before;
  }
}

std::uint32_t BlockOrdering::take_minimum() {
  while (memory_.head[minimum_] == kNone) {
    ++minimum_;
  }
  const std::uint32_t variable = memory_.head[minimum_];
  dequeue(variable);
  return variable;
}

Status BlockOrdering::analyse(std::uint32_t budget) {
  if (phase_ == Phase::idle) {
    return Status::invalid_argument;
  }
  visits_ = 0;
  while (phase_ != Phase::done && visits_ < budget) {
    switch (phase_) {
      case Phase::eliminate:
        if (cursor_ == count_) {
          memory_.begin[count_] = used_;
          phase_ = Phase::sort;
          cursor_ = 0;
        } else if (const Status status = eliminate(take_minimum()); status != Status::ok) {
          phase_ = Phase::idle;
          return status;
        }
        break;
      case Phase::sort:
        if (cursor_ == count_) {
          phase_ = Phase::locate;
          cursor_ = 0;
        } else {
          sort_column(cursor_++);
        }
        break;
      default:
        if (cursor_ == pairs_.size()) {
          phase_ = Phase::done;
        } else {
          locate(cursor_++);
        }
        break;
    }
  }
  return phase_ == Phase::done ? Status::ok : Status::busy;
}

/// Makes `pivot` the next column. Its pattern is the union of its neighbours, direct and through elements; it becomes
/// an element itself, which takes the place of those.
Status BlockOrdering::eliminate(std::uint32_t pivot) {
  const std::uint32_t tag = ++tag_;
  const std::uint32_t first = used_;
  memory_.position[pivot] = cursor_;
  memory_.variable[cursor_] = pivot;
  memory_.begin[cursor_] = first;
  ++cursor_;
  if (!gather(pivot, tag)) {
    return Status::full;
  }
  memory_.degree[pivot] = used_ - first;
  count_outside(first, tag);
  for (std::uint32_t k = first; k < used_; ++k) {
    update_neighbour(memory_.rows[k], pivot, tag);
  }
  visits_ += used_ - first + 1;
  return Status::ok;
}

/// Appends the pivot's pattern to the rows, marked with `tag`, and absorbs its elements. False where they do not fit.
bool BlockOrdering::gather(std::uint32_t pivot, std::uint32_t tag) {
  memory_.mark[pivot] = tag;
  const auto append = [this, tag](std::uint32_t variable) {
    if (memory_.mark[variable] == tag) {
      return true;
    }
    if (used_ == limits_.fill) {
      return false;
    }
    memory_.mark[variable] = tag;
    memory_.rows[used_++] = variable;
    return true;
  };
  const std::uint32_t list = memory_.list_begin[pivot];
  for (std::uint32_t k = 0; k < memory_.variables_in[pivot]; ++k) {
    if (!append(memory_.neighbours[list + k])) {
      return false;
    }
  }
  for (std::uint32_t k = 0; k < memory_.elements_in[pivot]; ++k) {
    const std::uint32_t element = memory_.neighbours[list + memory_.variables_in[pivot] + k];
    const std::uint32_t begin = memory_.begin[memory_.position[element]];
    const std::uint32_t size = memory_.degree[element];
    for (std::uint32_t r = begin; r < begin + size; ++r) {
      if (!append(memory_.rows[r])) {
        return false;
      }
    }
    memory_.degree[element] = kAbsorbed;
    visits_ += size;
  }
  return true;
}

/// For each element next to the new one: how many of its variables lie outside the new one.
void BlockOrdering::count_outside(std::uint32_t first, std::uint32_t tag) {
  for (std::uint32_t k = first; k < used_; ++k) {
    const std::uint32_t variable = memory_.rows[k];
    const std::uint32_t list = memory_.list_begin[variable] + memory_.variables_in[variable];
    for (std::uint32_t e = list; e < list + memory_.elements_in[variable]; ++e) {
      const std::uint32_t element = memory_.neighbours[e];
      if (memory_.degree[element] == kAbsorbed) {
        continue;
      }
      if (memory_.stamp[element] != tag) {
        memory_.stamp[element] = tag;
        memory_.outside[element] = memory_.degree[element];
      }
      --memory_.outside[element];
    }
    visits_ += memory_.elements_in[variable];
  }
}

/// Replaces what the new element covers in a variable's list by that element, and bounds the variable's new degree.
/// The list never grows: the pivot itself or an absorbed element leaves it.
void BlockOrdering::update_neighbour(std::uint32_t variable, std::uint32_t pivot, std::uint32_t tag) {
  const std::uint32_t list = memory_.list_begin[variable];
  const std::uint32_t old_variables = memory_.variables_in[variable];
  const std::uint32_t old_elements = memory_.elements_in[variable];
  const std::uint32_t pivot_size = memory_.degree[pivot];
  std::uint32_t variables = 0;
  for (std::uint32_t k = 0; k < old_variables; ++k) {
    const std::uint32_t other = memory_.neighbours[list + k];
    if (memory_.mark[other] != tag) {
      memory_.neighbours[list + variables++] = other;
    }
  }
  std::uint32_t elements = 0;
  std::uint32_t degree = variables + pivot_size - 1;
  for (std::uint32_t k = 0; k < old_elements; ++k) {
    const std::uint32_t element = memory_.neighbours[list + old_variables + k];
    if (memory_.degree[element] != kAbsorbed && memory_.outside[element] != 0) {
      memory_.neighbours[list + variables + elements++] = element;
      degree += memory_.outside[element];
    }
  }
  assert(variables + elements < memory_.list_begin[variable + 1] - list);
  memory_.neighbours[list + variables + elements++] = pivot;
  memory_.variables_in[variable] = variables;
  memory_.elements_in[variable] = elements;
  dequeue(variable);
  const std::uint32_t left = count_ - cursor_ - 1;
  memory_.degree[variable] = std::min({degree, left, memory_.degree[variable] + pivot_size - 1});
  enqueue(variable);
  visits_ += old_variables + old_elements;
}

void BlockOrdering::sort_column(std::uint32_t column) {
  std::uint32_t* const first = memory_.rows.data() + memory_.begin[column];
  std::uint32_t* const last = memory_.rows.data() + memory_.begin[column + 1];
  for (std::uint32_t* row = first; row != last; ++row) {
    *row = memory_.position[*row];
  }
  // Not std::sort, which recurses.
  std::make_heap(first, last);
  std::sort_heap(first, last);
  visits_ += static_cast<std::uint32_t>(last - first) + 1;
}

void BlockOrdering::locate(std::uint32_t pair) {
  ++visits_;
  const BlockPair& p = pairs_[pair];
  if (p.a == p.b) {
    memory_.slots[pair] = kNone;
    return;
  }
  const std::uint32_t column = std::min(position(p.a), position(p.b));
  const std::uint32_t row = std::max(position(p.a), position(p.b));
  const std::uint32_t* const first = memory_.rows.data() + memory_.begin[column];
  const std::uint32_t* const last = memory_.rows.data() + memory_.begin[column + 1];
  const std::uint32_t* const found = std::lower_bound(first, last, row);
  assert(found != last && *found == row);
  memory_.slots[pair] = static_cast<std::uint32_t>(found - memory_.rows.data());
}

std::uint32_t BlockOrdering::parent(std::uint32_t column) const {
  const std::uint32_t first = memory_.begin[column];
  return first == memory_.begin[column + 1] ? count_ : memory_.rows[first];
}

Span<std::uint32_t> BlockOrdering::scratch(std::uint32_t which) const {
  const Span<std::uint32_t> free_after[4] = {memory_.head, memory_.next, memory_.previous, memory_.mark};
  return free_after[which];
}

}  // namespace mellin
