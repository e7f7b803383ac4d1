#include "stamp_text.h"

#include <fmt/format.h>

#include <cctype>
#include <cmath>
#include <cstdlib>

namespace planar_vslam::io {
namespace {

constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;
constexpr std::size_t kNanosecondDigits = 9;
constexpr std::size_t kMaxSecondDigits = 9 + 1;  // 9,999,999,999 s still fit an int64 of nanoseconds twice over
// So long a whole number counts nanoseconds since 1970 (EuRoC, ORB-SLAM): the clocks of 1973 to 2262.
constexpr std::size_t kFewestNanosecondDigits = 18, kMostNanosecondDigits = 19;
constexpr double kMaxSeconds = 9.2e9;  // int64 nanoseconds end at 9.22e9 s

bool AllDigits(std::string_view text) {
  for (const char c : text) {
    if (std::isdigit(static_cast<unsigned char>(c)) == 0) return false;
  }
  return true;
}

std::int64_t DigitsToInteger(std::string_view digits) {
  std::int64_t value = 0;
  for (const char c : digits) value = 10 * value + (c - '0');
  return value;
}

// Plain decimal notation, digit by digit; nothing for any other notation.
std::optional<Timestamp> ParsePlainDecimal(std::string_view text) {
  const bool negative = !text.empty() && text.front() == '-';
  if (negative) text.remove_prefix(1);
  const std::size_t point = text.find('.');
  const std::string_view whole = text.substr(0, point);
  const std::string_view fraction = point == std::string_view::npos ? std::string_view() : text.substr(point + 1);
  if (whole.empty() || !AllDigits(whole) || !AllDigits(fraction)) return std::nullopt;
  const bool no_fraction = fraction.find_first_not_of('0') == std::string_view::npos;
  if (whole.size() >= kFewestNanosecondDigits && whole.size() <= kMostNanosecondDigits && no_fraction) {
    const std::optional<double> value = ParseNumber(whole);
    if (!value.has_value() || *value > kMaxSeconds * static_cast<double>(kNanosecondsPerSecond)) return std::nullopt;
    return Timestamp{negative ? -DigitsToInteger(whole) : DigitsToInteger(whole)};
  }
  if (whole.size() > kMaxSecondDigits) return std::nullopt;
  const std::int64_t seconds = DigitsToInteger(whole);
  if (static_cast<double>(seconds) > kMaxSeconds) return std::nullopt;
  std::string padded(fraction.substr(0, kNanosecondDigits));
  padded.resize(kNanosecondDigits, '0');
  const bool round_up = fraction.size() > kNanosecondDigits && fraction[kNanosecondDigits] >= '5';
  const std::int64_t nanoseconds = seconds * kNanosecondsPerSecond + DigitsToInteger(padded) + (round_up ? 1 : 0);
  return Timestamp{negative ? -nanoseconds : nanoseconds};
}

}  // namespace

StampText ParseStamp(std::string_view text) {
  if (const auto exact = ParsePlainDecimal(text)) return {StampText::Kind::kStamp, *exact};
  const std::optional<double> seconds = ParseNumber(text);
  if (!seconds.has_value()) return {};
  if (!std::isfinite(*seconds) || std::abs(*seconds) > kMaxSeconds) return {StampText::Kind::kNotFinite, {}};
  return {StampText::Kind::kStamp, Timestamp::FromSeconds(*seconds)};
}

std::string FormatStamp(Timestamp stamp) {
  const bool negative = stamp.nanoseconds < 0;
  const std::uint64_t magnitude =
      negative ? 0 - static_cast<std::uint64_t>(stamp.nanoseconds) : static_cast<std::uint64_t>(stamp.nanoseconds);
  constexpr auto kPerSecond = static_cast<std::uint64_t>(kNanosecondsPerSecond);
  return fmt::format("{}{}.{:09d}", negative ? "-" : "", magnitude / kPerSecond, magnitude % kPerSecond);
}

std::optional<double> ParseNumber(std::string_view text) {
  const std::string terminated(text);
  if (terminated.empty() || std::isspace(static_cast<unsigned char>(terminated.front())) != 0) return std::nullopt;
  char* end = nullptr;
  const double value = std::strtod(terminated.c_str(), &end);
  if (end != terminated.c_str() + terminated.size()) return std::nullopt;
  return value;
}

}  // namespace planar_vslam::io
