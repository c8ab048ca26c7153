// Bytes of a simulation's state, so that it goes on later as if it had never stopped. For the same build
// only: the layout is that of memory.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace weft {

// Writes values one after the other. A class lists what it consists of in one function for both directions:
//   template <typename Archive> void State(Archive& archive) { archive(a_), archive(b_); }
class StateWriter {
 public:
  template <typename Value>
  void operator()(Value& value) {
    Put(&value, sizeof(Value));
  }
  template <typename Value>
  void operator()(std::vector<Value>& values) {
    uint64_t count = values.size();
    (*this)(count);
    Put(values.data(), count * sizeof(Value));
  }
  const std::string& bytes() const { return bytes_; }

 private:
  void Put(const void* data, size_t size) { bytes_.append(static_cast<const char*>(data), size); }

  std::string bytes_;
};

class StateReader {
 public:
  explicit StateReader(std::string_view bytes) : bytes_(bytes) {}

  template <typename Value>
  void operator()(Value& value) {
    Take(&value, sizeof(Value));
  }
  template <typename Value>
  void operator()(std::vector<Value>& values) {
    uint64_t count = 0;
    (*this)(count);
    if (count > bytes_.size() / sizeof(Value)) ok_ = false;
    if (!ok_) return;
    values.resize(count);
    Take(values.data(), count * sizeof(Value));
  }
  // False when there were fewer bytes than asked for, or some are left.
  bool Complete() const { return ok_ && bytes_.empty(); }

 private:
  void Take(void* data, size_t size) {
    if (size > bytes_.size()) ok_ = false;
    if (!ok_ || size == 0) return;
    std::memcpy(data, bytes_.data(), size);
    bytes_.remove_prefix(size);
  }

  std::string_view bytes_;
  bool ok_ = true;
};

}  // namespace weft
