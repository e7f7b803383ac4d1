#include "bag_bytes.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace planar_vslam::io {

MappedFile::MappedFile(const std::filesystem::path& path) : memory_(MAP_FAILED) {
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  struct stat status {};
  const bool opened = file >= 0 && fstat(file, &status) == 0;
  if (opened && status.st_size > 0) {
    size_ = static_cast<std::size_t>(status.st_size);
    memory_ = mmap(nullptr, size_, PROT_READ, MAP_PRIVATE, file, 0);
  }
  const bool empty = opened && status.st_size == 0;
  if (memory_ == MAP_FAILED && !empty) problem_ = std::error_code(errno, std::generic_category()).message();
  if (file >= 0) close(file);
}

MappedFile::~MappedFile() {
  if (memory_ != MAP_FAILED) munmap(memory_, size_);
}

std::string_view MappedFile::bytes() const {
  return memory_ == MAP_FAILED ? std::string_view() : std::string_view(static_cast<const char*>(memory_), size_);
}

std::string_view TakeBytes(std::uint64_t length, std::string_view* rest) {
  if (length > rest->size()) throw BadBag{fmt::format("a block of {} bytes has only {} left", length, rest->size())};
  const std::string_view bytes = rest->substr(0, length);
  rest->remove_prefix(length);
  return bytes;
}

}  // namespace planar_vslam::io
