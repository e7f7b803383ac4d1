#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <string>

#include "support/support.h"

namespace planar_vslam {
namespace {

TEST(Version, IsThatOfThePackage) {
  FILE* pipe = ::popen((test::Executable() + " --version").c_str(), "r");
  ASSERT_NE(pipe, nullptr);
  std::array<char, 256> line{};
  ASSERT_NE(std::fgets(line.data(), line.size(), pipe), nullptr);
  EXPECT_EQ(::pclose(pipe), 0);
  std::ifstream file(test::SourceFolder() / "package.xml");
  const std::string package((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  const std::string name = "planar_vslam ", said = line.data();
  ASSERT_EQ(said.rfind(name, 0), 0u) << said;
  EXPECT_NE(package.find("<version>" + said.substr(name.size(), said.size() - name.size() - 1) + "</version>"),
            std::string::npos)
      << said;
}

}  // namespace
}  // namespace planar_vslam
