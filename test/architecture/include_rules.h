#pragma once
// Reads the sources and says which of them break the rules of ARCHITECTURE.md. Everything works on plain values, so
// that the rules themselves can be tested on made-up files.
#include <filesystem>
#include <string>
#include <vector>

namespace planar_vslam::test {

struct SourceFile {
  std::string path;  // relative to the root of the package, with '/'
  std::vector<std::string> lines;
};

// Files below `folders` (or `folders` themselves) whose name ends in one of `endings`, in order of path.
std::vector<SourceFile> ReadSources(const std::filesystem::path& root, const std::vector<std::string>& folders,
                                    const std::vector<std::string>& endings);

// Each of these gives one line "file:line: what is wrong" for every violation, none for sound sources.
std::vector<std::string> ModuleViolations(const std::vector<SourceFile>& files);  // against the graph of modules
std::vector<std::string> RimViolations(const std::vector<SourceFile>& files);     // ROS and PCL where they must not be
std::vector<std::string> CycleViolations(const std::vector<SourceFile>& files);   // headers that include each other
std::vector<std::string> LengthViolations(const std::vector<SourceFile>& files);  // files over kMaxLines
std::vector<std::string> FlagViolations(const std::vector<SourceFile>& cmake_files);  // flags that break libraries

constexpr std::size_t kMaxLines = 600;

}  // namespace planar_vslam::test
