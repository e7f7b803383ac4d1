#pragma once
// Stamps as decimal seconds in text files, exact to the nanosecond (a double is not, for today's epoch seconds).
#include <optional>
#include <string>
#include <string_view>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/sensor/timestamp.h"

namespace planar_vslam::io {

struct StampText {
  enum class Kind { kStamp, kNotFinite, kMalformed };
  Kind kind = Kind::kMalformed;
  Timestamp stamp;  // of kStamp
};

// Seconds: "1305031102.175304", "-0.5", "12", "1e3"; whole numbers of 18 or 19 digits are nanoseconds. "nan" and "inf"
// are kNotFinite, as are seconds beyond +-292 years.
StampText ParseStamp(std::string_view text);

// Seconds with 9 decimals; ParseStamp gives the stamp back.
std::string FormatStamp(Timestamp stamp);

// A whole field as a number ("nan" and "inf" included), or nothing.
std::optional<double> ParseNumber(std::string_view text);

}  // namespace planar_vslam::io
