// File names in services stay below ~map_directory.
#include "map_files.h"

#include <gtest/gtest.h>

#include <fstream>

#include "support/support.h"

namespace planar_vslam::ros_face {
namespace {

namespace fs = std::filesystem;

TEST(MapFiles, NamesAreBelowTheFolder) {
  const test::TemporaryFolder folder;
  const fs::path root = fs::canonical(folder.path());
  for (const std::string name : {"lab", "lab.pvm", "./lab", "rooms/../lab"}) {
    const Expected<fs::path> file = ResolveMapName(folder.path(), name, ".pvm");
    ASSERT_TRUE(file.ok()) << file.error().message;
    EXPECT_EQ(*file, root / "lab.pvm") << name;
  }
  EXPECT_EQ(*ResolveMapName(folder.path(), "rooms/lab.2", ".yaml"), root / "rooms/lab.2.yaml");
}

TEST(MapFiles, NamesThatLeadOutAreRefused) {
  const test::TemporaryFolder folder, elsewhere;
  fs::create_directory_symlink(elsewhere.path(), folder.path() / "link");
  std::ofstream(elsewhere.path() / "secret.pvm") << "secret";
  fs::create_symlink(elsewhere.path() / "secret.pvm", folder.path() / "file.pvm");
  for (const std::string& name :
       {std::string(), std::string("."), std::string(".."), std::string("/etc/passwd"), std::string("../lab"),
        std::string("rooms/../../lab"), std::string("rooms/"), std::string("rooms/.."), std::string("link/lab"),
        std::string("link/../../lab"), std::string("file"), std::string("file.pvm"), std::string("a\0b", 3),
        std::string(100'000, 'x'), std::string(".pvm/..")}) {
    const Expected<fs::path> file = ResolveMapName(folder.path(), name, ".pvm");
    EXPECT_FALSE(file.ok()) << (file.ok() ? file->string() : "");
  }
}

}  // namespace
}  // namespace planar_vslam::ros_face
