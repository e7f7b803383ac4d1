#pragma once
// Numbers to and from little-endian bytes. Writer and reader have the same members, so that one template lists the
// fields of a record for both directions.
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <type_traits>

#include "planar_vslam/geometry/check.h"

namespace planar_vslam::map_file {

template <class T>
struct UnsignedOf {
  static_assert(std::is_integral_v<T> || std::numeric_limits<T>::is_iec559, "written as its bits");
  static_assert(sizeof(T) == 4 || sizeof(T) == 8);
  using Type = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;
};

class ByteWriter {
 public:
  static constexpr bool kReading = false;

  template <class T>
  void Number(const T& value) {
    typename UnsignedOf<T>::Type bits = 0;
    std::memcpy(&bits, &value, sizeof(bits));
    for (std::size_t i = 0; i < sizeof(bits); ++i) bytes_.push_back(static_cast<char>((bits >> (8 * i)) & 0xFFU));
  }
  template <class T>
  void Numbers(const T* values, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) Number(values[i]);
  }
  void Flag(bool value) { bytes_.push_back(value ? '\1' : '\0'); }
  // The number of elements that all of `sequences` have.
  template <class First, class... More>
  void Size(std::size_t /*bytes_each*/, const First& first, const More&... more) {
    const std::size_t size = first.size();
    PV_CHECK(((more.size() == size) && ...) && size <= std::numeric_limits<std::uint32_t>::max(), "size=" << size);
    Number(static_cast<std::uint32_t>(size));
  }

  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

// The first problem stays; from then on what is read into keeps its value.
class ByteReader {
 public:
  static constexpr bool kReading = true;

  // `bytes` outlive the reader.
  explicit ByteReader(const std::string& bytes) : bytes_(bytes) {}

  template <class T>
  void Number(T& value) {
    typename UnsignedOf<T>::Type bits = 0;
    if (!Require(sizeof(bits))) return;
    for (std::size_t i = 0; i < sizeof(bits); ++i) bits |= static_cast<decltype(bits)>(NextByte()) << (8 * i);
    std::memcpy(&value, &bits, sizeof(bits));
  }
  template <class T>
  void Numbers(T* values, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) Number(values[i]);
  }
  void Flag(bool& value) {
    if (!Require(1)) return;
    const unsigned byte = NextByte();
    if (byte > 1) return Fail("flag " + std::to_string(byte) + ", expected 0 or 1");
    value = byte == 1;
  }
  // A number of elements of at least `bytes_each` bytes, which therefore must still be there.
  std::size_t Count(std::size_t bytes_each) {
    std::uint32_t count = 0;
    Number(count);
    if (ok() && count > left() / bytes_each) {
      Fail(std::to_string(count) + " elements, expected at most the " + std::to_string(left() / bytes_each) +
           " that fit in the rest");
    }
    return ok() ? count : 0;
  }
  template <class... Sequences>
  void Size(std::size_t bytes_each, Sequences&... sequences) {
    const std::size_t size = Count(bytes_each);
    (sequences.resize(size), ...);
  }

  bool ok() const { return problem_.empty(); }
  const std::string& problem() const { return problem_; }
  std::size_t left() const { return bytes_.size() - position_; }
  void Fail(const std::string& problem) {
    if (ok()) problem_ = "before byte " + std::to_string(position_) + ": " + problem;
  }

 private:
  bool Require(std::size_t count) {
    if (left() < count) Fail("ends too early, expected " + std::to_string(count) + " bytes more");
    return ok();
  }
  unsigned NextByte() { return static_cast<unsigned char>(bytes_[position_++]); }

  const std::string& bytes_;
  std::size_t position_ = 0;
  std::string problem_;
};

}  // namespace planar_vslam::map_file
