// Containers of fixed capacity: over the caller's memory (Ring, List) or with their own (FixedList).
#pragma once

#include <cassert>
#include <cstddef>

#include "mellin/core/span.hpp"

namespace mellin {

/// First in, first out over memory that somebody else owns. Index 0 is the oldest element.
template <class T>
class Ring {
 public:
  Ring() = default;
  explicit Ring(Span<T> memory) : memory_(memory) {}

  std::size_t size() const { return size_; }
  std::size_t capacity() const { return memory_.size(); }
  bool empty() const { return size_ == 0; }
  bool full() const { return size_ == memory_.size(); }

  T& operator[](std::size_t i) {
    assert(i < size_);
    return memory_[slot(i)];
  }
  const T& operator[](std::size_t i) const {
    assert(i < size_);
    return memory_[slot(i)];
  }
  T& back() { return (*this)[size_ - 1]; }
  const T& back() const { return (*this)[size_ - 1]; }
  T& front() { return (*this)[0]; }
  const T& front() const { return (*this)[0]; }

  /// Makes room for one more at the back and returns it as it lies in memory. Requires !full().
  T& push_slot() {
    assert(!full());
    ++size_;
    return back();
  }
  void push(const T& value) { push_slot() = value; }
  /// Requires !empty().
  void pop() {
    assert(!empty());
    start_ = start_ + 1 == memory_.size() ? 0 : start_ + 1;
    --size_;
  }
  void clear() { start_ = size_ = 0; }

 private:
  std::size_t slot(std::size_t i) const {
    const std::size_t at = start_ + i;
    return at >= memory_.size() ? at - memory_.size() : at;
  }
  Span<T> memory_;
  std::size_t start_ = 0;
  std::size_t size_ = 0;
};

/// A list of at most capacity() elements over memory that somebody else owns.
template <class T>
class List {
 public:
  List() = default;
  explicit List(Span<T> memory) : memory_(memory) {}

  std::size_t size() const { return size_; }
  std::size_t capacity() const { return memory_.size(); }
  bool empty() const { return size_ == 0; }
  bool full() const { return size_ == memory_.size(); }
  T& operator[](std::size_t i) {
    assert(i < size_);
    return memory_[i];
  }
  const T& operator[](std::size_t i) const {
    assert(i < size_);
    return memory_[i];
  }
  T& back() { return (*this)[size_ - 1]; }
  const T& back() const { return (*this)[size_ - 1]; }
  T* begin() { return memory_.begin(); }
  T* end() { return memory_.begin() + size_; }
  const T* begin() const { return memory_.begin(); }
  const T* end() const { return memory_.begin() + size_; }

  /// Returns false, and keeps the list as it was, when full.
  bool push(const T& value) {
    if (full()) {
      return false;
    }
    memory_[size_++] = value;
    return true;
  }
  void pop() {
    assert(!empty());
    --size_;
  }
  /// Removes element i, keeping the order of the others.
  void erase(std::size_t i) {
    assert(i < size_);
    for (std::size_t k = i + 1; k < size_; ++k) {
      memory_[k - 1] = memory_[k];
    }
    --size_;
  }
  void clear() { size_ = 0; }

 private:
  Span<T> memory_;
  std::size_t size_ = 0;
};

/// A list of at most N elements that holds its own memory.
template <class T, std::size_t N>
class FixedList {
 public:
  std::size_t size() const { return size_; }
  static constexpr std::size_t capacity() { return N; }
  bool empty() const { return size_ == 0; }
  bool full() const { return size_ == N; }
  T& operator[](std::size_t i) {
    assert(i < size_);
    return items_[i];
  }
  const T& operator[](std::size_t i) const {
    assert(i < size_);
    return items_[i];
  }
  T* begin() { return items_; }
  T* end() { return items_ + size_; }
  const T* begin() const { return items_; }
  const T* end() const { return items_ + size_; }

  /// Returns false, and keeps the list as it was, when full.
  bool push(const T& value) {
    if (full()) {
      return false;
    }
    items_[size_++] = value;
    return true;
  }
  /// Inserts before position i, dropping the last element when full. Requires i <= size().
  void insert(std::size_t i, const T& value) {
    assert(i <= size_);
    if (i >= N) {
      return;
    }
    if (size_ < N) {
      ++size_;
    }
    for (std::size_t k = size_ - 1; k > i; --k) {
      items_[k] = items_[k - 1];
    }
    items_[i] = value;
  }
  /// Removes element i; those behind move up.
  void erase(std::size_t i) {
    assert(i < size_);
    for (std::size_t k = i + 1; k < size_; ++k) {
      items_[k - 1] = items_[k];
    }
    --size_;
  }
  void clear() { size_ = 0; }

 private:
  T items_[N] = {};
  std::size_t size_ = 0;
};

}  // namespace mellin
