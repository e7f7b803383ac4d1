#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <string>

#include "support/support.h"

namespace planar_vslam {
namespace {

std::string Output(const std::string& command) {
  FILE* pipe = ::popen(command.c_str(), "r");
  if (pipe == nullptr) return "";
  std::string output;
  std::array<char, 4096> part{};
  while (const std::size_t count = std::fread(part.data(), 1, part.size(), pipe)) output.append(part.data(), count);
  EXPECT_EQ(::pclose(pipe), 0) << command;
  return output;
}

// What bash offers behind these words.
std::string Completed(const std::string& words, int position) {
  const std::string script = "source <(" + test::Executable() + " shell completion); COMP_WORDS=(planar_vslam " +
                             words + "); COMP_CWORD=" + std::to_string(position) +
                             "; _planar_vslam; echo \" ${COMPREPLY[*]} \"";
  return Output("bash -c '" + script + "'");
}

bool Offers(const std::string& completed, const std::string& word) {
  return completed.find(" " + word + " ") != std::string::npos;
}

TEST(Shell, CompletesCommandsAndOptions) {
  EXPECT_EQ(Completed("doc", 1), " doctor \n");
  EXPECT_TRUE(Offers(Completed("\"\"", 1), "run"));
  EXPECT_TRUE(Offers(Completed("map \"\"", 2), "export"));
  EXPECT_EQ(Completed("run drive.bag --save", 3), " --save-map \n");
  EXPECT_TRUE(Offers(Completed("map info --", 3), "--json"));
  EXPECT_FALSE(Offers(Completed("map info --", 3), "--out"));
  EXPECT_TRUE(Offers(Completed("simulate --b", 2), "--bag"));  // of a group
  EXPECT_EQ(Completed("run drive", 2), "  \n");                // bash goes on with file names
}

TEST(Shell, TheManualHasEveryCommandAndItsOptions) {
  const std::string page = Output(test::Executable() + " shell manual");
  for (const char* part : {".TH PLANAR_VSLAM 1", ".SS planar_vslam run\n", ".SS planar_vslam map info\n",
                           ".SS planar_vslam simulate\n", "\\-\\-save\\-map", "\\-\\-bag"}) {
    EXPECT_NE(page.find(part), std::string::npos) << part;
  }
  // Of roff's requests only those that the page is made of: no text begins a line with a dot.
  std::string line;
  for (const char character : page) {
    if (character != '\n') {
      line += character;
      continue;
    }
    if (!line.empty() && line[0] == '.') {
      const std::string request = line.substr(0, 3);
      EXPECT_TRUE(request == ".TH" || request == ".SH" || request == ".SS" || request == ".TP" || request == ".B " ||
                  request == ".I " || request == ".br")
          << line;
    }
    line.clear();
  }
}

}  // namespace
}  // namespace planar_vslam
