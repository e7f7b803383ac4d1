#pragma once
// Counts bad single messages by reason and names the first of each reason on stderr.
#include <map>
#include <optional>
#include <string>

#include "planar_vslam/sensor/timestamp.h"

namespace planar_vslam::io {

class SkipLog {
 public:
  // `where` says which message: file and line, or topic and stamp.
  void Count(const std::string& reason, const std::string& where);
  const std::map<std::string, long>& counts() const { return counts_; }

 private:
  std::map<std::string, long> counts_;
};

// Lets only later and later stamps of one stream through.
class StampGate {
 public:
  bool Accept(Timestamp stamp) {
    if (last_.has_value() && stamp <= *last_) return false;
    last_ = stamp;
    return true;
  }

 private:
  std::optional<Timestamp> last_;
};

}  // namespace planar_vslam::io
