#pragma once
// Lines of a text table (comma- or blank-separated) with comments skipped and positions kept for error messages.
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "planar_vslam/geometry/expected.h"

namespace planar_vslam::io {

enum class Separator { kComma, kBlank };

class TextTable {
 public:
  static Expected<TextTable> Open(const std::filesystem::path& path, Separator separator);

  // Next line that is neither empty nor a # comment; false at the end of the file.
  bool NextLine();
  // Fields of the current line, trimmed; valid until the next NextLine().
  const std::vector<std::string_view>& fields() const { return fields_; }
  // "file:line: message"
  Error ErrorHere(const std::string& message) const;
  // "file:line"
  std::string Position() const;
  // Whether reading stopped for another reason than the end of the file.
  bool failed() const { return stream_.bad(); }

 private:
  TextTable(const std::filesystem::path& path, Separator separator);
  void Split();

  std::filesystem::path path_;
  Separator separator_;
  std::ifstream stream_;
  std::string line_;
  long line_number_ = 0;
  std::vector<std::string_view> fields_;
};

}  // namespace planar_vslam::io
