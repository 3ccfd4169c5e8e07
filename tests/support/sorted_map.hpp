// A small map in a sorted vector, for tests that also run where no C++ library keeps a tree.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace mellin::test {

template <class Key, class Value>
class SortedMap {
 public:
  using Items = std::vector<std::pair<Key, Value>>;

  Value& operator[](const Key& key) {
    auto at = place(key);
    if (at == items_.end() || at->first != key) {
      at = items_.insert(at, {key, Value{}});
    }
    return at->second;
  }
  void erase(const Key& key) {
    const auto at = place(key);
    if (at != items_.end() && at->first == key) {
      items_.erase(at);
    }
  }
  std::size_t size() const { return items_.size(); }
  bool empty() const { return items_.empty(); }
  auto begin() const { return items_.begin(); }
  auto end() const { return items_.end(); }
  friend bool operator==(const SortedMap& a, const SortedMap& b) { return a.items_ == b.items_; }

 private:
  auto place(const Key& key) {
    return std::lower_bound(items_.begin(), items_.end(), key,
                            [](const auto& item, const Key& wanted) { return item.first < wanted; });
  }

  Items items_;
};

}  // namespace mellin::test
