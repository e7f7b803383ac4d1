#include "text_table.h"

#include <fmt/format.h>

namespace planar_vslam::io {
namespace {

constexpr std::string_view kBlanks = " \t\r";
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";  // of UTF-8, which Windows' programs write

std::string_view Trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

}  // namespace

TextTable::TextTable(const std::filesystem::path& path, Separator separator)
    : path_(path), separator_(separator), stream_(path) {}

Expected<TextTable> TextTable::Open(const std::filesystem::path& path, Separator separator) {
  if (!std::filesystem::is_regular_file(path)) return Error{fmt::format("{}: no such file", path.string())};
  TextTable table(path, separator);
  if (!table.stream_) return Error{fmt::format("{}: cannot be opened for reading", path.string())};
  const int first = table.stream_.peek();
  if (first == 0xFE || first == 0xFF) return Error{fmt::format("{}: is UTF-16; expected UTF-8 text", path.string())};
  return table;
}

bool TextTable::NextLine() {
  while (std::getline(stream_, line_)) {
    if (++line_number_ == 1 && line_.compare(0, kByteOrderMark.size(), kByteOrderMark) == 0) {
      line_.erase(0, kByteOrderMark.size());
    }
    const std::string_view content = Trimmed(line_);
    if (content.empty() || content.front() == '#') continue;
    Split();
    return true;
  }
  return false;
}

void TextTable::Split() {
  fields_.clear();
  std::string_view rest = Trimmed(line_);
  const std::string_view separators = separator_ == Separator::kComma ? std::string_view(",") : kBlanks;
  while (true) {
    const std::size_t end = rest.find_first_of(separators);
    fields_.push_back(Trimmed(rest.substr(0, end)));
    if (end == std::string_view::npos) return;
    rest = rest.substr(end + 1);
    if (separator_ == Separator::kBlank) rest = Trimmed(rest);
  }
}

std::string TextTable::Position() const { return fmt::format("{}:{}", path_.string(), line_number_); }

Error TextTable::ErrorHere(const std::string& message) const { return {Position() + ": " + message}; }

}  // namespace planar_vslam::io
