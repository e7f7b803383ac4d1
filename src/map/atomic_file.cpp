#include "atomic_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <system_error>

namespace planar_vslam {
namespace {

namespace fs = std::filesystem;

// An open file that is removed again unless it was renamed.
class TemporaryFile {
 public:
  // A new file in the folder of `path`, whose name no other writer has.
  explicit TemporaryFile(const fs::path& path) {
    constexpr int kMaxAttempts = 1000;  // leftovers of crashes with this process id, and other threads
    for (int attempt = 0; attempt < kMaxAttempts && descriptor_ < 0; ++attempt) {
      name_ = path.string() + "." + std::to_string(::getpid()) + "." + std::to_string(attempt) + ".part";
      descriptor_ = ::open(name_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
      if (descriptor_ < 0 && errno != EEXIST) return;
    }
  }
  ~TemporaryFile() {
    const int unreported = errno;  // the caller reports why it gave up
    if (descriptor_ >= 0) ::close(descriptor_);
    if (exists_) ::unlink(name_.c_str());
    errno = unreported;
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  bool Write(const std::string& bytes) {
    if (descriptor_ < 0) return false;
    exists_ = true;
    for (std::size_t done = 0; done < bytes.size();) {
      const ssize_t written = ::write(descriptor_, bytes.data() + done, bytes.size() - done);
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) return false;
      done += static_cast<std::size_t>(written);
    }
    if (::fsync(descriptor_) != 0) return false;
    const int closed = ::close(descriptor_);
    descriptor_ = -1;
    return closed == 0;
  }
  bool RenameTo(const fs::path& path) {
    if (std::rename(name_.c_str(), path.c_str()) != 0) return false;
    exists_ = false;
    return true;
  }

 private:
  std::string name_;
  int descriptor_ = -1;
  bool exists_ = false;
};

// The new name is on the disk once its folder is. Not every file system can do this, so nobody asks whether it did.
void SyncFolder(const fs::path& folder) {
  const int descriptor = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  ::fsync(descriptor);
  ::close(descriptor);
}

}  // namespace

Expected<bool> WriteFileAtomically(const fs::path& path, const std::string& bytes) {
  std::error_code unreadable;
  const fs::file_status present = fs::status(path, unreadable);
  if (fs::exists(present) && !fs::is_regular_file(present)) {
    return Error{path.string() + ": cannot be replaced, expected a file or a new name"};
  }
  TemporaryFile file(path);
  if (!file.Write(bytes) || !file.RenameTo(path)) {
    return Error{path.string() + ": cannot be written: " + std::generic_category().message(errno)};
  }
  SyncFolder(path.parent_path());
  return true;
}

}  // namespace planar_vslam
