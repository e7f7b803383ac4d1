// Rewrites the bag of a simulated drive as another robot would have recorded it: the same light, another encoding,
// another camera_info, a camera that hangs otherwise. What should come out is the same drive.
//
// usage: bench_recode BASE.bag OUT.bag FORM; without arguments: the forms there are
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <tf2_msgs/TFMessage.h>

#include <Eigen/Geometry>
#include <cstdio>
#include <exception>
#include <functional>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>
#include <utility>

#include "recode_image.h"

namespace planar_vslam::bench {
namespace {

constexpr char kImages[] = "/camera/image_raw/compressed", kCameraInfo[] = "/camera/camera_info";

// What becomes of the camera's messages; what is not set stays as it is.
struct Recoding {
  std::function<cv::Mat(const cv::Mat&, const sensor_msgs::CameraInfo&)> picture;
  std::function<void(sensor_msgs::CameraInfo*)> info;
  std::string image_topic;  // instead of the usual one
  std::string format;       // jpeg, png; else a form of raw images
  int quarter_turns = 0;    // of the camera about its axis, to the right
};

// A Bayer mosaic before its colours are balanced: image_transport packs it as it is.
cv::Mat Mosaic(const cv::Mat& grey, const sensor_msgs::CameraInfo&) {
  constexpr double kRed = 0.6, kBlue = 0.7;  // of green
  cv::Mat mosaic = grey.clone();
  for (int row = 0; row < mosaic.rows; ++row) {
    for (int column = row % 2; column < mosaic.cols; column += 2) {
      auto& value = mosaic.at<std::uint8_t>(row, column);
      value = cv::saturate_cast<std::uint8_t>((row % 2 == 0 ? kRed : kBlue) * value);
    }
  }
  return mosaic;
}

cv::Mat Half(const cv::Mat& grey, const sensor_msgs::CameraInfo&) {
  cv::Mat half;
  cv::resize(grey, half, {}, 0.5, 0.5, cv::INTER_AREA);
  return half;
}

constexpr int kLeft = 106, kTop = 80, kWide = 428, kHigh = 320;  // px, of the region of interest

void SayRegion(sensor_msgs::CameraInfo* info) {
  info->roi.x_offset = kLeft, info->roi.y_offset = kTop;
  info->roi.width = kWide, info->roi.height = kHigh;
}

// The picture turned by quarters to the left is what a camera turned to the right sees.
cv::Mat Turned(cv::Mat picture, int quarters) {
  for (int k = 0; k < quarters; ++k) cv::rotate(cv::Mat(picture), picture, cv::ROTATE_90_COUNTERCLOCKWISE);
  return picture;
}

// With no more distortion than that of radii, which the sample drive has.
void TurnInfo(int quarters, sensor_msgs::CameraInfo* info) {
  for (int k = 0; k < quarters; ++k) {
    const double fx = info->K[0], cx = info->K[2], fy = info->K[4], cy = info->K[5];
    info->K = {fy, 0, cy, 0, fx, info->width - 1.0 - cx, 0, 0, 1};
    info->P = {fy, 0, cy, 0, 0, fx, info->width - 1.0 - cx, 0, 0, 0, 1, 0};
    std::swap(info->width, info->height);
  }
}

Recoding TurnedBy(int quarters) {
  Recoding turned;
  turned.picture = [quarters](const cv::Mat& grey, const auto&) { return Turned(grey.clone(), quarters); };
  turned.info = [quarters](sensor_msgs::CameraInfo* info) { TurnInfo(quarters, info); };
  turned.format = "jpeg";
  turned.quarter_turns = quarters;
  return turned;
}

// The same lens spelt otherwise: with so many numbers.
Recoding Saying(const std::string& model, std::size_t numbers) {
  Recoding said;
  said.info = [model, numbers](sensor_msgs::CameraInfo* info) {
    info->distortion_model = model;
    info->D.resize(numbers, 0.0);
  };
  return said;
}

cv::Mat Flat(const cv::Mat& grey, const sensor_msgs::CameraInfo& info) {
  const cv::Mat K(3, 3, CV_64F, const_cast<double*>(info.K.data()));
  cv::Mat flat;
  cv::undistort(grey, flat, K, info.D, K);
  return flat;
}

// Rectified images whose camera_info still has the D of the raw ones.
Recoding Rectified(const std::string& name) {
  Recoding rectified;
  rectified.picture = Flat;
  rectified.info = [](sensor_msgs::CameraInfo* info) { info->D = {-0.312987, 0.065093, -0.000877, 0.001404, 0.0}; };
  rectified.format = "jpeg";
  rectified.image_topic = "/camera/" + name + "/compressed";
  return rectified;
}

std::map<std::string, Recoding> Recodings() {
  std::map<std::string, Recoding> all;
  for (const std::string& form : ImageForms()) all[form].format = form;
  all["png"].format = "png";
  all["bayer-in-jpeg"].picture = Mosaic;
  all["bayer-in-jpeg"].format = "jpeg";
  all["plumb_bob-4"] = Saying("plumb_bob", 4);
  all["plumb_bob-8"] = Saying("plumb_bob", 8);
  all["rational_polynomial-8"] = Saying("rational_polynomial", 8);
  all["unnamed-lens"] = Saying("", 5);
  all["image_rect"] = Rectified("image_rect");
  all["image_color_rect"] = Rectified("image_color_rect");
  all["rectified-by-setting"] = Rectified("flat");
  Recoding binned, region;
  binned.picture = Half;
  binned.info = [](sensor_msgs::CameraInfo* info) { info->binning_x = info->binning_y = 2; };
  binned.format = "jpeg";
  region.picture = [](const cv::Mat& grey, const auto&) { return grey(cv::Rect(kLeft, kTop, kWide, kHigh)).clone(); };
  region.info = SayRegion;
  region.format = "jpeg";
  all["binning"] = binned;
  all["region-of-interest"] = region;
  all["on-its-side"] = TurnedBy(1);
  all["upside-down"] = TurnedBy(2);
  return all;
}

std::vector<std::uint8_t> Packed(const cv::Mat& picture, const std::string& format) {
  constexpr int kQuality = 95;
  std::vector<std::uint8_t> bytes;
  const bool jpeg = format == "jpeg";
  cv::imencode(jpeg ? ".jpg" : ".png", picture, bytes,
               jpeg ? std::vector<int>{cv::IMWRITE_JPEG_QUALITY, kQuality} : std::vector<int>{});
  return bytes;
}

void WriteImage(const sensor_msgs::CompressedImage& packed, const sensor_msgs::CameraInfo& camera,
                const ros::Time& time, const Recoding& recoding, rosbag::Bag* out) {
  const std::string topic = recoding.image_topic.empty() ? kImages : recoding.image_topic;
  if (recoding.format.empty()) return out->write(topic, time, packed);
  cv::Mat picture = cv::imdecode(packed.data, cv::IMREAD_GRAYSCALE);
  if (recoding.picture) picture = recoding.picture(picture, camera);
  if (recoding.format == "jpeg" || recoding.format == "png") {
    sensor_msgs::CompressedImage again = packed;
    again.format = recoding.format;
    again.data = Packed(picture, recoding.format);
    return out->write(topic, time, again);
  }
  sensor_msgs::Image image;
  image.header = packed.header;
  image.width = static_cast<std::uint32_t>(picture.cols);
  image.height = static_cast<std::uint32_t>(picture.rows);
  ToImage(picture, recoding.format, &image);
  out->write("/camera/image_raw", time, image);
}

void WriteMounts(tf2_msgs::TFMessage tf, const ros::Time& time, int quarter_turns, rosbag::Bag* out) {
  const Eigen::Quaterniond roll(Eigen::AngleAxisd(0.5 * M_PI * quarter_turns, Eigen::Vector3d::UnitZ()));
  for (geometry_msgs::TransformStamped& transform : tf.transforms) {
    if (transform.child_frame_id.find("camera") == std::string::npos) continue;
    geometry_msgs::Quaternion& q = transform.transform.rotation;
    const Eigen::Quaterniond turned = Eigen::Quaterniond(q.w, q.x, q.y, q.z) * roll;
    q.x = turned.x(), q.y = turned.y(), q.z = turned.z(), q.w = turned.w();
  }
  out->write("/tf_static", time, tf);
}

sensor_msgs::CameraInfo FirstCamera(const rosbag::Bag& bag) {
  rosbag::View view(bag, rosbag::TopicQuery(kCameraInfo));
  if (view.size() == 0) throw std::runtime_error("no camera_info");
  return *view.begin()->instantiate<sensor_msgs::CameraInfo>();
}

void Recode(const std::string& base, const std::string& out_path, const Recoding& recoding) {
  rosbag::Bag in(base, rosbag::bagmode::Read), out(out_path, rosbag::bagmode::Write);
  const sensor_msgs::CameraInfo camera = FirstCamera(in);
  rosbag::View view(in);
  for (const rosbag::MessageInstance& message : view) {
    const ros::Time time = message.getTime();
    if (const auto packed = message.instantiate<sensor_msgs::CompressedImage>()) {
      WriteImage(*packed, camera, time, recoding, &out);
    } else if (const auto info = message.instantiate<sensor_msgs::CameraInfo>()) {
      sensor_msgs::CameraInfo changed = *info;
      if (recoding.info) recoding.info(&changed);
      out.write(kCameraInfo, time, changed);
    } else if (const auto tf = message.instantiate<tf2_msgs::TFMessage>(); message.getTopic() == "/tf_static" && tf) {
      WriteMounts(*tf, time, recoding.quarter_turns, &out);
    } else {
      out.write(message.getTopic(), time, message, message.getConnectionHeader());
    }
  }
}

int Main(int count, char** arguments) {
  const std::map<std::string, Recoding> recodings = Recodings();
  if (count == 1) {
    for (const auto& [name, recoding] : recodings) std::printf("%s\n", name.c_str());
    return 0;
  }
  const auto found = count == 4 ? recodings.find(arguments[3]) : recodings.end();
  if (found == recodings.end()) {
    std::fprintf(stderr, "usage: bench_recode BASE.bag OUT.bag FORM; without arguments: the forms there are\n");
    return 2;
  }
  Recode(arguments[1], arguments[2], found->second);
  return 0;
}

}  // namespace
}  // namespace planar_vslam::bench

int main(int count, char** arguments) {
  try {
    return planar_vslam::bench::Main(count, arguments);
  } catch (const std::exception& exception) {
    std::fprintf(stderr, "bench_recode: %s\n", exception.what());
    return 1;
  }
}
