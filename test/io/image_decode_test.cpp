// Image files in memory against OpenCV's codecs, and damaged ones.
#include "image_decode.h"

#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "planar_vslam/sensor/jpeg.h"
#include "support/support.h"

namespace planar_vslam::io {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr int kWidth = 61, kHeight = 43;  // px, multiples of nothing

// Noise on a ramp, so that neighbours are alike and blocks differ.
cv::Mat RandomImage(int type, std::uint64_t seed, int width = kWidth, int height = kHeight) {
  cv::Mat image(height, width, type);
  cv::RNG random(seed);
  random.fill(image, cv::RNG::UNIFORM, 0, CV_MAT_DEPTH(type) == CV_16U ? 65536 : 256);
  cv::GaussianBlur(image, image, {3, 3}, 0);
  return image;
}

Bytes Encode(const std::string& ending, const cv::Mat& image, const std::vector<int>& parameters = {}) {
  Bytes bytes;
  EXPECT_TRUE(cv::imencode(ending, image, bytes, parameters));
  return bytes;
}

// An image alone in its stream.
std::optional<GrayImage> Decoded(const Bytes& bytes) {
  GreyDepth depth;
  return DecodeImage(bytes, &depth);
}

GrayImage Gray(const cv::Mat& image) {
  return {image.cols, image.rows, std::make_shared<Bytes>(image.begin<std::uint8_t>(), image.end<std::uint8_t>())};
}

void ExpectAsOpenCv(const Bytes& bytes, const std::string& what) {
  const cv::Mat expected = cv::imdecode(bytes, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
  ASSERT_FALSE(expected.empty()) << what;
  const std::optional<GrayImage> image = Decoded(bytes);
  ASSERT_TRUE(image.has_value()) << what;
  EXPECT_EQ(image->width, expected.cols) << what;
  EXPECT_EQ(image->height, expected.rows) << what;
  EXPECT_TRUE(*image->pixels == *Gray(expected).pixels) << what;
}

void Append(png_structp png, png_bytep data, png_size_t count) {
  auto* bytes = static_cast<Bytes*>(png_get_io_ptr(png));
  bytes->insert(bytes->end(), data, data + count);
}

struct PngKind {
  int color_type, depth;
  bool interlaced = false, transparent = false, gamma = false;
};

// Random pixels of a kind that cv::imencode does not write.
Bytes RandomPng(const PngKind& kind) {
  Bytes bytes;
  std::mt19937 generator(7);
  const auto random = [&generator] { return static_cast<png_byte>(generator() >> 24); };
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_set_write_fn(png, &bytes, Append, nullptr);
  png_set_IHDR(png, info, kWidth, kHeight, kind.depth, kind.color_type,
               kind.interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_BASE,
               PNG_FILTER_TYPE_BASE);
  if (kind.gamma) png_set_gAMA(png, info, 0.45455);
  std::vector<png_color> palette(std::size_t{1} << std::min(kind.depth, 8));
  for (png_color& color : palette) color = {random(), random(), random()};
  if (kind.color_type == PNG_COLOR_TYPE_PALETTE)
    png_set_PLTE(png, info, palette.data(), static_cast<int>(palette.size()));
  const Bytes alphas{0, 100};
  const png_color_16 clear{1, 1, 1, 1, 1};
  if (kind.transparent) png_set_tRNS(png, info, alphas.data(), static_cast<int>(alphas.size()), &clear);
  png_write_info(png, info);
  std::vector<Bytes> pixels(kHeight, Bytes(png_get_rowbytes(png, info)));
  std::vector<png_bytep> rows;
  for (Bytes& row : pixels) {
    std::generate(row.begin(), row.end(), random);
    rows.push_back(row.data());
  }
  png_write_image(png, rows.data());
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  return bytes;
}

Bytes BytesOf(const std::string& text) { return {text.begin(), text.end()}; }

TEST(ImageDecode, JpegIsLumaAsOpenCvReadsIt) {
  const std::vector<std::vector<int>> kinds{{cv::IMWRITE_JPEG_QUALITY, 95},
                                            {cv::IMWRITE_JPEG_QUALITY, 30, cv::IMWRITE_JPEG_OPTIMIZE, 1},
                                            {cv::IMWRITE_JPEG_PROGRESSIVE, 1},
                                            {cv::IMWRITE_JPEG_RST_INTERVAL, 3}};
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    for (const int type : {CV_8UC1, CV_8UC3})
      ExpectAsOpenCv(Encode(".jpg", RandomImage(type, k + 1), kinds[k]), std::to_string(k));
  }
}

TEST(ImageDecode, PngBecomesGreyAsOpenCvReadsIt) {
  for (const int type : {CV_8UC1, CV_8UC3, CV_8UC4, CV_16UC1, CV_16UC3, CV_16UC4})
    ExpectAsOpenCv(Encode(".png", RandomImage(type, 3)), cv::typeToString(type));
  for (const auto& [color_type, depths] : std::vector<std::pair<int, std::vector<int>>>{
           {PNG_COLOR_TYPE_GRAY, {1, 2, 4, 8, 16}},
           {PNG_COLOR_TYPE_GRAY_ALPHA, {8, 16}},
           {PNG_COLOR_TYPE_PALETTE, {1, 2, 4, 8}},
           {PNG_COLOR_TYPE_RGB, {8, 16}},
           {PNG_COLOR_TYPE_RGB_ALPHA, {8, 16}},
       }) {
    const bool can_be_transparent = (color_type & PNG_COLOR_MASK_ALPHA) == 0;
    for (const int depth : depths) {
      for (int mask = 0; mask < 8; ++mask) {
        const PngKind kind{color_type, depth, (mask & 1) != 0, (mask & 2) != 0 && can_be_transparent, (mask & 4) != 0};
        ExpectAsOpenCv(RandomPng(kind),
                       std::to_string(color_type) + " " + std::to_string(depth) + " " + std::to_string(mask));
      }
    }
  }
}

TEST(ImageDecode, PnmBecomesGreyAsOpenCvReadsIt) {
  for (const auto& [type, ending] :
       {std::pair(CV_8UC1, ".pgm"), {CV_16UC1, ".pgm"}, {CV_8UC3, ".ppm"}, {CV_16UC3, ".ppm"}})
    ExpectAsOpenCv(Encode(ending, RandomImage(type, 5)), cv::typeToString(type) + ending);
  ExpectAsOpenCv(BytesOf("P5\n# a comment\n2 1 # another\n200\nab"), "comments, fewer than 255 levels");
}

TEST(ImageDecode, RecordedImagesAreAsOpenCvReadsThem) {
  const auto folder = test::SequenceFolder("dev_lab");
  if (!folder.has_value()) GTEST_SKIP() << "recorded data are not here";
  for (const char* name : {"images/000000.jpg", "images/000100.jpg", "images/000200.jpg"}) {
    std::ifstream file(*folder / name, std::ios::binary);
    ExpectAsOpenCv(Bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>()), name);
  }
}

TEST(ImageDecode, WhatEndsEarlyIsNoImage) {
  const std::vector<Bytes> files{
      Encode(".jpg", RandomImage(CV_8UC1, 1)),
      Encode(".jpg", RandomImage(CV_8UC3, 2)),
      Encode(".jpg", RandomImage(CV_8UC3, 3), {cv::IMWRITE_JPEG_PROGRESSIVE, 1}),
      Encode(".png", RandomImage(CV_8UC3, 4)),
      RandomPng({PNG_COLOR_TYPE_PALETTE, 4, true}),
      Encode(".pgm", RandomImage(CV_16UC1, 5)),
      Encode(".ppm", RandomImage(CV_8UC3, 6)),
  };
  testing::internal::CaptureStderr();
  for (std::size_t f = 0; f < files.size(); ++f) {
    const Bytes& whole = files[f];
    ASSERT_TRUE(Decoded(whole).has_value()) << f;
    for (std::size_t cut : {std::size_t{1}, std::size_t{2}, std::size_t{3}, std::size_t{12}, std::size_t{30},
                            whole.size() / 2, whole.size() - 30}) {
      EXPECT_FALSE(Decoded(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(cut))).has_value())
          << f << " cut to " << cut;
    }
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(ImageDecode, JpegWithoutItsEndMarkerIsWhole) {
  Bytes bytes = Encode(".jpg", RandomImage(CV_8UC1, 1));
  const std::optional<GrayImage> whole = Decoded(bytes);
  bytes.resize(bytes.size() - 2);
  const std::optional<GrayImage> image = Decoded(bytes);
  ASSERT_TRUE(whole.has_value() && image.has_value());
  EXPECT_TRUE(*image->pixels == *whole->pixels);
}

TEST(ImageDecode, DamagedBytesDoNoHarm) {
  const std::vector<Bytes> files{Encode(".jpg", RandomImage(CV_8UC3, 1)),
                                 Encode(".jpg", RandomImage(CV_8UC1, 3), {cv::IMWRITE_JPEG_PROGRESSIVE, 1}),
                                 Encode(".png", RandomImage(CV_8UC3, 4)), RandomPng({PNG_COLOR_TYPE_PALETTE, 4, true}),
                                 Encode(".ppm", RandomImage(CV_8UC3, 6))};
  std::mt19937 generator(1);
  testing::internal::CaptureStderr();
  for (const Bytes& whole : files) {
    for (int trial = 0; trial < 300; ++trial) {
      Bytes bytes = whole;
      for (int i = 0; i < 4; ++i) {
        // Half of the damage goes to the headers.
        const std::size_t range = i % 2 == 0 ? std::min<std::size_t>(bytes.size(), 200) : bytes.size();
        const std::size_t position = 2 + generator() % (range - 2);
        // Sides stay below 2^14, so that the test allocates little.
        bytes[position] = static_cast<std::uint8_t>(bytes[position] ^ (1U << (generator() % 6)));
      }
      const std::optional<GrayImage> image = Decoded(bytes);
      if (!image.has_value()) continue;
      EXPECT_EQ(image->pixels->size(),
                static_cast<std::size_t>(image->width) * static_cast<std::size_t>(image->height));
    }
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(ImageDecode, HugeImagesAreNotDecoded) {
  Bytes jpeg = Encode(".jpg", RandomImage(CV_8UC1, 1));
  const Bytes frame{0xff, 0xc0};
  const auto sides = std::search(jpeg.begin(), jpeg.end(), frame.begin(), frame.end()) + 5;
  std::fill(sides, sides + 4, std::uint8_t{0xfe});  // 65278 x 65278
  EXPECT_FALSE(Decoded(jpeg).has_value());

  Bytes png;
  png_structp writer = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(writer);
  png_set_write_fn(writer, &png, Append, nullptr);
  png_set_IHDR(writer, info, 100000, 100000, 8, PNG_COLOR_TYPE_GRAY, 0, 0, 0);
  png_write_info(writer, info);
  png_write_chunk(writer, reinterpret_cast<png_const_bytep>("IDAT"), nullptr, 0);
  png_destroy_write_struct(&writer, &info);
  EXPECT_FALSE(Decoded(png).has_value());

  for (const std::string sides_text : {"100000 100000", "18446744073709551617 1", "0 5", "-1 5", "5"})
    EXPECT_FALSE(Decoded(BytesOf("P5 " + sides_text + " 255\nabcde")).has_value()) << sides_text;
  for (const std::string greatest : {"0", "65536", "x", ""})
    EXPECT_FALSE(Decoded(BytesOf("P5 1 1 " + greatest + "\nabcde")).has_value()) << greatest;
}

TEST(ImageDecode, OtherFormatsAreNotRead) {
  EXPECT_FALSE(Decoded({}).has_value());
  EXPECT_FALSE(Decoded(BytesOf("not a picture")).has_value());
  EXPECT_FALSE(Decoded(BytesOf("P2 1 1 255 7 ")).has_value());
  EXPECT_FALSE(Decoded(Encode(".bmp", RandomImage(CV_8UC1, 1))).has_value());
}

TEST(JpegEncode, BytesAreThoseOfOpenCv) {
  for (const int quality : {10, 75, 95, 100}) {
    for (const auto& [width, height] : {std::pair(kWidth, kHeight), {1, 1}, {640, 480}}) {
      const cv::Mat image = RandomImage(CV_8UC1, static_cast<std::uint64_t>(quality), width, height);
      const std::optional<Bytes> bytes = EncodeJpeg(Gray(image), quality);
      ASSERT_TRUE(bytes.has_value());
      EXPECT_TRUE(*bytes == Encode(".jpg", image, {cv::IMWRITE_JPEG_QUALITY, quality})) << quality << " " << width;
    }
  }
}

TEST(JpegEncode, NoiseFits) {
  cv::Mat noise(kHeight, kWidth, CV_8UC1);
  cv::randu(noise, 0, 2);
  const std::optional<Bytes> bytes = EncodeJpeg(Gray(noise * 255), 100);
  ASSERT_TRUE(bytes.has_value());
  EXPECT_TRUE(DecodeJpeg(*bytes).has_value());
}

TEST(JpegEncode, ImpossibleSizesAreRefused) {
  EXPECT_FALSE(EncodeJpeg(GrayImage{}, 95).has_value());
  EXPECT_FALSE(EncodeJpeg(GrayImage{70000, 1, std::make_shared<Bytes>(70000)}, 95).has_value());
}

TEST(ImageDecode, FilesOfFewBitsFillTheRangeAndKeepIt) {
  for (const char* ending : {".png", ".pgm"}) {
    GreyDepth depth;
    for (const auto& [peak, expected] : {std::pair(1000, 250), {500, 125}, {4000, 250}, {1000, 62}}) {
      cv::Mat image(20, 30, CV_16UC1, cv::Scalar(peak));
      image.at<std::uint16_t>(3, 4) = 1;
      const std::optional<GrayImage> grey = DecodeImage(Encode(ending, image), &depth);
      ASSERT_TRUE(grey.has_value());
      EXPECT_EQ((*grey->pixels)[0], expected) << ending << " " << peak;
    }
  }
}

TEST(ImageDecode, AHotPixelIsNoRange) {
  cv::Mat image(100, 100, CV_16UC1, cv::Scalar(1000));
  image.at<std::uint16_t>(50, 50) = 65535;
  const std::optional<GrayImage> grey = Decoded(Encode(".png", image));
  ASSERT_TRUE(grey.has_value());
  EXPECT_EQ((*grey->pixels)[0], 250);
  EXPECT_EQ((*grey->pixels)[50 * 100 + 50], 255);
}

}  // namespace
}  // namespace planar_vslam::io
