#pragma once
// The bytes of a recording's file, taken apart from front to back. Numbers are little-endian, as on every machine this
// runs on.
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>

namespace planar_vslam::io {

// What is wrong with a file, on its way up to who knows the file's name.
struct BadBag : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// A whole file of a kind that is not read.
struct OtherBag : BadBag {
  using BadBag::BadBag;
};

// Read only; empty where it cannot be read, and `problem` says why.
class MappedFile {
 public:
  explicit MappedFile(const std::filesystem::path& path);
  ~MappedFile();
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;
  std::string_view bytes() const;
  const std::string& problem() const { return problem_; }  // the system's words: Permission denied

 private:
  void* memory_;
  std::string problem_;
  std::size_t size_ = 0;
};

// The number at the front; throws BadBag where there is none.
template <class Number>
Number ReadNumber(std::string_view bytes) {
  if (bytes.size() < sizeof(Number)) throw BadBag{"a number is cut off"};
  Number value;
  std::memcpy(&value, bytes.data(), sizeof(Number));
  return value;
}

// The same; `rest` moves behind it.
template <class Number>
Number TakeNumber(std::string_view* rest) {
  const auto value = ReadNumber<Number>(*rest);
  rest->remove_prefix(sizeof(Number));
  return value;
}

// The first bytes; `rest` moves behind them. Throws BadBag where there are fewer.
std::string_view TakeBytes(std::uint64_t length, std::string_view* rest);

// The bytes behind their length.
template <class Length = std::uint32_t>
std::string_view TakeBlock(std::string_view* rest) {
  const auto length = TakeNumber<Length>(rest);
  return TakeBytes(length, rest);
}

}  // namespace planar_vslam::io
