// Folders of ROS 2's recorder.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "bag_testing.h"

namespace planar_vslam::test {
namespace {

namespace fs = std::filesystem;

class BagFolder : public ::testing::Test {
 protected:
  // Two files of one drive: images up to 0.5 in the first, which alone has the camera_info, then up to 1.0.
  fs::path Folder(const char* extension = ".mcap") const {
    for (const int part : {0, 1}) {
      BagWriter writer(folder_.path() / fmt::format("drive_{}{}", part, extension));
      if (part == 0) writer.PutInfo();
      for (int i = 1; i <= 5; ++i) writer.PutImage(0.5 * part + 0.1 * i);
    }
    return folder_.path();
  }
  void WriteMetadata(const std::vector<std::string>& files) const {
    std::string text = "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n";
    text += "  relative_file_paths:\n";
    for (const std::string& file : files) text += "    - " + file + "\n";
    WriteText(folder_.path() / "metadata.yaml", text);
  }

 private:
  TemporaryFolder folder_;
};

TEST_F(BagFolder, ItsFilesAreOneDrive) {
  const fs::path folder = Folder();
  WriteMetadata({"drive_0.mcap", "drive_1.mcap"});
  EXPECT_EQ(Play(folder).images.size(), 10U);
  WriteMetadata({"some_name/drive_0.mcap", "some_name/drive_1.mcap"});  // as the first recorders wrote it
  EXPECT_EQ(Play(folder).images.size(), 10U);
}

TEST_F(BagFolder, ARecorderThatWasStoppedHardLeavesNoMetadata) {
  for (const char* extension : {".mcap", ".db3"}) {
    const Replay replay = Play(Folder(extension));
    EXPECT_EQ(replay.error, "");
    EXPECT_GE(replay.images.size(), 10U);
  }
}

TEST_F(BagFolder, WhatMetadataGetsWrongIsNamed) {
  const fs::path folder = Folder();
  WriteMetadata({"drive_0.mcap", "drive_7.mcap"});
  ExpectInError(OpenError(folder), {"metadata.yaml", "drive_7.mcap"});
  WriteMetadata({});
  ExpectInError(OpenError(folder), {"metadata.yaml", "relative_file_paths"});
  for (const char* text : {"[", "a: b", "7", ""}) {
    WriteText(folder / "metadata.yaml", text);
    ExpectInError(OpenError(folder), {"metadata.yaml"});
  }
}

TEST_F(BagFolder, FilesPackedAsAWholeAreNamedWithWhatUnpacksThem) {
  const fs::path folder = Folder();
  fs::rename(folder / "drive_1.mcap", folder / "drive_1.mcap.zstd");
  ExpectInError(OpenError(folder), {"drive_1.mcap.zstd", "zstd -d"});
}

TEST_F(BagFolder, WhatWasUnpackedIsReadWhereverThePackedFileIsLeft) {
  const fs::path folder = Folder();
  for (const bool named : {false, true}) {
    for (const bool kept : {true, false}) {
      fs::remove(folder / "metadata.yaml");
      if (named) WriteMetadata({"drive_0.mcap.zstd", "drive_1.mcap.zstd"});
      for (const char* name : {"drive_0.mcap.zstd", "drive_1.mcap.zstd"}) {
        fs::remove(folder / name);
        if (kept) WriteText(folder / name, "packed");
      }
      const Replay replay = Play(folder);
      EXPECT_EQ(replay.error, "");
      EXPECT_EQ(replay.images.size(), 10U);
      EXPECT_TRUE(replay.skipped.empty()) << "nothing comes twice";
    }
  }
}

TEST_F(BagFolder, RosbagsAndRecordingsOfRos2AreNotMixed) {
  const fs::path folder = Folder();
  { BagWriter(folder / "x.bag").PutInfo(); }
  const auto mixed = OpenRecording(std::vector<fs::path>{folder / "x.bag", folder / "drive_0.mcap"}, {});
  ASSERT_FALSE(mixed.ok());
  ExpectInError(mixed.error().message, {"x.bag", "one kind"});
}

TEST_F(BagFolder, RosbagsInAFolderAreAskedForByName) {
  const fs::path folder = Folder(".bag");
  ExpectInError(OpenError(folder), {folder.string() + ": a folder of rosbags", folder.string() + "/*.bag"});
}

TEST_F(BagFolder, ADatasetFolderStaysOne) {
  const fs::path folder = Folder();
  WriteText(folder / "images.csv", "t,file\n");
  const std::string error = OpenError(folder);
  EXPECT_EQ(error.find("mcap"), std::string::npos) << error;
}

}  // namespace
}  // namespace planar_vslam::test
