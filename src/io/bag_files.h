#pragma once
// The bags of one drive, read as one: a recorder that splits its files writes tf_static into the first only. A bag is a
// rosbag (v2), an .mcap or a .db3; or a folder of ROS 2's recorder, which holds some of the latter two.
#include <rosbag/bag.h>

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "bag_message.h"
#include "bag_source.h"
#include "planar_vslam/geometry/expected.h"

namespace planar_vslam::io {

struct Bags {  // one of them is not empty
  std::vector<std::unique_ptr<rosbag::Bag>> rosbags;
  std::vector<std::unique_ptr<MessageSource>> sources;
  std::vector<std::string> notes;  // what the user should know
};

// Throws what rosbag throws on broken files; an error names the file.
Expected<Bags> OpenBags(const std::vector<std::filesystem::path>& paths);
// What they are called in messages.
std::string NameOf(const std::vector<std::filesystem::path>& paths);
// The type of each topic, as ROS 1 spells it.
std::map<std::string, std::string> TypesOfTopics(const Bags& bags);
// The messages of all of them on these topics, in the order of recording, until `visit` says false.
void ForEachMessage(const Bags& bags, const std::vector<std::string>& topics,
                    const std::function<bool(const StoredMessage&)>& visit);

}  // namespace planar_vslam::io
