#include "bag_cdr.h"

#include <algorithm>

#include "bag_message.h"

namespace planar_vslam::io {
namespace {

constexpr std::size_t kRepresentationBytes = 4;
constexpr char kBigEndian = 0x00, kLittleEndian = 0x01;

void SwapBytes(void* numbers, std::size_t count, std::size_t size) {
  char* number = static_cast<char*>(numbers);
  for (std::size_t i = 0; i < count; ++i, number += size) std::reverse(number, number + size);
}

std::size_t Aligned(std::size_t position, std::size_t size) { return (position + size - 1) / size * size; }

}  // namespace

CdrReader::CdrReader(std::string_view bytes) {
  if (bytes.size() < kRepresentationBytes) throw DamagedMessage();
  if (bytes[0] != 0 || (bytes[1] != kBigEndian && bytes[1] != kLittleEndian)) {
    throw DamagedMessage("message not in plain CDR");
  }
  swap_ = bytes[1] == kBigEndian;
  bytes_ = bytes.substr(kRepresentationBytes);
}

void CdrReader::Read(std::string* text) {
  const std::size_t length = ReadCount(1);  // with the zero byte at its end
  *text = bytes_.substr(position_, length);
  position_ += length;
  if (!text->empty() && text->back() == '\0') text->pop_back();
}

void CdrReader::Read(ros::Time* time) {
  std::int32_t seconds = 0;
  std::uint32_t nanoseconds = 0;
  (*this)(seconds, nanoseconds);
  // Before 1970 is no time that ROS 1 can say; zero is refused where stamps are checked.
  *time = seconds < 0 ? ros::Time() : ros::Time(static_cast<std::uint32_t>(seconds), nanoseconds);
}

std::size_t CdrReader::ReadCount(std::size_t element_size) {
  std::uint32_t count = 0;
  Read(&count);
  if (count > (bytes_.size() - position_) / element_size) throw DamagedMessage();
  return count;
}

void CdrReader::ReadNumbers(void* numbers, std::size_t count, std::size_t size) {
  const std::size_t begin = Aligned(position_, size);
  if (begin > bytes_.size() || count > (bytes_.size() - begin) / size) throw DamagedMessage();
  std::memcpy(numbers, bytes_.data() + begin, count * size);
  if (swap_) SwapBytes(numbers, count, size);
  position_ = begin + count * size;
}

CdrWriter::CdrWriter(bool big_endian) : bytes_(kRepresentationBytes, '\0'), swap_(big_endian) {
  bytes_[1] = big_endian ? kBigEndian : kLittleEndian;
}

void CdrWriter::Write(const std::string& text) {
  Write(static_cast<std::uint32_t>(text.size() + 1));
  bytes_.append(text.c_str(), text.size() + 1);
}

void CdrWriter::Write(const ros::Time& time) { (*this)(static_cast<std::int32_t>(time.sec), time.nsec); }

void CdrWriter::WriteNumbers(const void* numbers, std::size_t count, std::size_t size) {
  const std::size_t begin = kRepresentationBytes + Aligned(bytes_.size() - kRepresentationBytes, size);
  bytes_.resize(begin + count * size);
  std::memcpy(bytes_.data() + begin, numbers, count * size);
  if (swap_) SwapBytes(bytes_.data() + begin, count, size);
}

}  // namespace planar_vslam::io
