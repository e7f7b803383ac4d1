#pragma once
// The messages of a bag by their header stamps: one pass over the bag before it is streamed, so that neither the order
// of recording nor how late a message came counts. Held in memory is where each message is, not the message.
#include <deque>
#include <string>
#include <vector>

#include "bag_files.h"
#include "bag_topics.h"
#include "planar_vslam/io/odometry_messages.h"
#include "planar_vslam/sensor/timestamp.h"
#include "skip_log.h"

namespace planar_vslam::io {

// The messages of one topic, later and later.
class StreamIndex {
 public:
  void Add(Timestamp stamp, const StoredMessage& message);
  // Puts them into order; of messages with one stamp the first stays. Says how many went, and the first of them.
  long Sort();

  std::size_t size() const { return entries_.size(); }
  Timestamp stamp(std::size_t i) const { return entries_[i].stamp; }
  const StoredMessage& message(std::size_t i) const { return messages_[entries_[i].message]; }

 private:
  struct Entry {
    Timestamp stamp;
    std::size_t message;
  };
  std::vector<Entry> entries_;
  std::deque<StoredMessage> messages_;
};

struct BagIndex {
  StreamIndex images, odometry, scans;
  OdometrySurvey odometry_survey;
  std::vector<std::string> notes;  // what the user should know
};

// Stamps of zero, and of a message before, are counted. Throws what rosbag throws on broken files.
BagIndex ReadIndex(const Bags& bags, const BagTopics& topics, SkipLog* skipped);

}  // namespace planar_vslam::io
