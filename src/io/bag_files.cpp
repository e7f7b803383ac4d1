#include "bag_files.h"

#include <console_bridge/console.h>
#include <fmt/format.h>

#include "bag_check.h"

namespace planar_vslam::io {

Expected<Bags> OpenBags(const std::vector<std::filesystem::path>& paths) {
  // Its own words on stderr would come beside our one line.
  console_bridge::setLogLevel(console_bridge::CONSOLE_BRIDGE_LOG_NONE);
  Bags bags;
  for (const std::filesystem::path& path : paths) {
    if (const auto damage = CheckBag(path)) return *damage;
    bags.push_back(std::make_unique<rosbag::Bag>());
    bags.back()->open(path.string(), rosbag::bagmode::Read);
  }
  return bags;
}

std::string NameOf(const std::vector<std::filesystem::path>& paths) {
  if (paths.size() == 1) return paths.front().string();
  return fmt::format("{} and {} more", paths.front().string(), paths.size() - 1);
}

void Show(const Bags& bags, const std::vector<std::string>& topics, rosbag::View* view) {
  for (const auto& bag : bags) view->addQuery(*bag, rosbag::TopicQuery(topics));
}

}  // namespace planar_vslam::io
