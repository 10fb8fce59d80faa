#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>

namespace semvslam {

static_assert(std::endian::native == std::endian::little, "files are written in the machine's byte order");

template <typename T>
concept PlainNumber = std::is_arithmetic_v<T> && !std::is_same_v<T, bool>;

/// Appends numbers to a string, little-endian and without gaps.
class ByteWriter {
 public:
  template <PlainNumber T>
  void put(T value) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + sizeof(T));
    std::memcpy(bytes_.data() + at, &value, sizeof(T));
  }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

/// Takes them out again. Behind the end everything is 0 and ended() stays true: ask once for many numbers.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  template <PlainNumber T>
  T get() {
    T value{};
    if (left() < sizeof(T)) {
      at_ = bytes_.size();
      ended_ = true;
    } else {
      std::memcpy(&value, bytes_.data() + at_, sizeof(T));
      at_ += sizeof(T);
    }
    return value;
  }
  /// How many things follow. @param bytes_each that each of them takes at least: more than there is room for is 0, and
  /// ended(), before anybody allocates for them.
  std::uint32_t get_count(std::size_t bytes_each) {
    const auto count = get<std::uint32_t>();
    if (count <= left() / bytes_each) return count;
    at_ = bytes_.size();
    ended_ = true;
    return 0;
  }
  std::size_t left() const { return bytes_.size() - at_; }
  bool ended() const { return ended_; }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
  bool ended_ = false;
};

}  // namespace semvslam
