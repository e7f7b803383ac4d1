#include "map_sections.h"

#include <utility>

#include "byte_stream.h"

namespace planar_vslam::map_file {
namespace {

// The least that one element takes: a count that claims more elements than the bytes left can hold is wrong.
constexpr std::size_t kBytesPerScale = 8;
constexpr std::size_t kBytesPerFeature = 28 + 32 + 4;              // keypoint, descriptor, landmark id
constexpr std::size_t kBytesPerKeyframe = 4 + 8 + 2 * 56 + 2 + 4;  // id, stamp, two motions, two flags, feature count
constexpr std::size_t kBytesPerObservation = 8;
constexpr std::size_t kBytesPerRange = 4;
constexpr std::size_t kBytesPerSweep = 8 + 4 * 8 + 4 + 56 + 3 * 8;  // stamp, laser, range count, two motions
constexpr std::size_t kBytesPerLink = 4 + (3 + 9 + 3) * 8;
constexpr std::size_t kBytesPerSweepList = 4 + 4 + 4;                         // keyframe id, sweep and link counts
constexpr std::size_t kBytesPerLandmark = 4 + 24 + 4 + 4 + 8 + 32 + 24 + 16;  // as in LandmarkFields, none observed

// Each of these lists the fields of a value once: a ByteWriter takes it const, a ByteReader fills it in.

template <class Stream, class Camera>
void CameraFields(Stream& s, Camera& camera) {
  s.Number(camera.width);
  s.Number(camera.height);
  for (auto* value :
       {&camera.fx, &camera.fy, &camera.cx, &camera.cy, &camera.k1, &camera.k2, &camera.p1, &camera.p2, &camera.k3}) {
    s.Number(*value);
  }
}

// Of version 3 on.
template <class Stream, class Camera>
void LensFields(Stream& s, Camera& camera) {
  for (auto* value : {&camera.k4, &camera.k5, &camera.k6}) s.Number(*value);
  bool equidistant = camera.lens == Lens::kEquidistant;
  s.Flag(equidistant);
  if constexpr (Stream::kReading) camera.lens = equidistant ? Lens::kEquidistant : Lens::kRadial;
}

template <class Stream, class AnyMap>
void MapFields(Stream& s, AnyMap& map) {
  s.Number(map.next_keyframe_id);
  s.Number(map.next_landmark_id);
  s.Flag(map.metric);
  s.Size(kBytesPerScale, map.octave_scales);
  s.Numbers(map.octave_scales.data(), map.octave_scales.size());
}

template <class Stream, class Motion>
void RigidFields(Stream& s, Motion& T) {
  s.Numbers(T.rotation.coeffs().data(), 4);  // x y z w
  s.Numbers(T.translation.data(), 3);
}

template <class Stream, class Link>
void LinkFields(Stream& s, Link& link) {
  auto& odometry = link.motion;
  s.Number(link.from.value);
  s.Numbers(odometry.T_i_j.translation.data(), 2);
  s.Number(odometry.T_i_j.angle);
  s.Numbers(odometry.covariance.data(), 9);  // by columns
  s.Number(odometry.distance);
  s.Number(odometry.turn);
  s.Number(odometry.seconds);
}

template <class Stream, class Link>
void OptionalLinkFields(Stream& s, Link& link) {
  bool present = link.has_value();
  s.Flag(present);
  if (!present) return;
  if constexpr (Stream::kReading) link.emplace();
  LinkFields(s, *link);
}

template <class Stream, class Features, class Ids>
void FeatureFields(Stream& s, Features& features, Ids& landmarks) {
  s.Size(kBytesPerFeature, features.keypoints, features.descriptors, landmarks);
  for (auto& keypoint : features.keypoints) {
    s.Numbers(keypoint.pixel.data(), 2);
    s.Numbers(keypoint.raw_pixel.data(), 2);
    s.Number(keypoint.angle);
    s.Number(keypoint.response);
    s.Number(keypoint.octave);
  }
  for (auto& descriptor : features.descriptors) s.Numbers(descriptor.data(), descriptor.size());
  for (auto& id : landmarks) s.Number(id.value);
}

template <class Stream, class AnyKeyframe>
void KeyframeFields(Stream& s, AnyKeyframe& keyframe) {
  s.Number(keyframe.stamp.nanoseconds);
  RigidFields(s, keyframe.T_map_base);
  RigidFields(s, keyframe.T_base_camera);
  s.Flag(keyframe.on_floor);
  OptionalLinkFields(s, keyframe.odometry_link);
  if constexpr (Stream::kReading) {
    auto features = std::make_shared<FrameFeatures>();
    FeatureFields(s, *features, keyframe.landmarks);
    features->grid = ImageGrid(features->keypoints);
    keyframe.features = std::move(features);
  } else {
    FeatureFields(s, *keyframe.features, keyframe.landmarks);
  }
}

template <class Stream, class AnyLandmark>
void LandmarkFields(Stream& s, AnyLandmark& landmark) {
  s.Numbers(landmark.p_map.data(), 3);
  s.Size(kBytesPerObservation, landmark.observations);
  for (auto& observation : landmark.observations) {
    s.Number(observation.keyframe.value);
    s.Number(observation.keypoint);
  }
  s.Number(landmark.created_by.value);
  s.Number(landmark.predicted_visible);
  s.Number(landmark.found);
  s.Numbers(landmark.descriptor.data(), landmark.descriptor.size());
  s.Numbers(landmark.view_direction.data(), 3);
  s.Number(landmark.min_distance);
  s.Number(landmark.max_distance);
}

template <class Stream, class Scan>
void ScanFields(Stream& s, Scan& scan) {
  s.Number(scan.stamp.nanoseconds);
  for (auto* value : {&scan.angle_min, &scan.angle_increment, &scan.range_min, &scan.range_max}) s.Number(*value);
  s.Size(kBytesPerRange, scan.ranges);
  s.Numbers(scan.ranges.data(), scan.ranges.size());
}

template <class Stream, class Sweep>
void SweepFields(Stream& s, Sweep& sweep) {
  RigidFields(s, sweep.T_base_laser);
  s.Numbers(sweep.T_keyframe_base.translation.data(), 2);
  s.Number(sweep.T_keyframe_base.angle);
  if constexpr (Stream::kReading) {
    auto scan = std::make_shared<PlanarScan>();
    ScanFields(s, *scan);
    sweep.scan = std::move(scan);
  } else {
    ScanFields(s, *sweep.scan);
  }
}

template <class Stream, class AnyKeyframe>
void LaserFields(Stream& s, AnyKeyframe& keyframe) {
  s.Size(kBytesPerSweep, keyframe.sweeps);
  for (auto& sweep : keyframe.sweeps) SweepFields(s, sweep);
  s.Size(kBytesPerLink, keyframe.laser_links);
  for (auto& link : keyframe.laser_links) LinkFields(s, link);
}

bool HasLaser(const Keyframe& keyframe) { return !keyframe.sweeps.empty() || !keyframe.laser_links.empty(); }

// The sweeps and links of the keyframes that have any.
void WriteLaser(ByteWriter& s, const Map& map) {
  std::vector<const IdMap<KeyframeId, Keyframe>::Entry*> with_laser;
  for (const auto& entry : map.keyframes) {
    if (HasLaser(entry.second)) with_laser.push_back(&entry);
  }
  s.Size(kBytesPerSweepList, with_laser);
  for (const auto* entry : with_laser) {
    s.Number(entry->first.value);
    LaserFields(s, entry->second);
  }
}

void ReadLaser(ByteReader& s, Map* map) {
  for (std::size_t left = s.Count(kBytesPerSweepList); left > 0 && s.ok(); --left) {
    KeyframeId id;
    s.Number(id.value);
    Keyframe* keyframe = map->keyframes.FindToEdit(id);
    if (keyframe == nullptr || HasLaser(*keyframe)) {
      s.Fail("sweeps of keyframe " + std::to_string(id.value) + ", expected a keyframe of the map, once");
      return;
    }
    LaserFields(s, *keyframe);
  }
}

template <class IdType, class Value>
void WriteEntries(ByteWriter& s, const IdMap<IdType, Value>& entries, void (*fields)(ByteWriter&, const Value&)) {
  s.Size(0, entries);
  for (const auto& [id, value] : entries) {
    s.Number(id.value);
    fields(s, value);
  }
}

template <class IdType, class Value>
void ReadEntries(ByteReader& s, std::size_t bytes_each, void (*fields)(ByteReader&, Value&),
                 IdMap<IdType, Value>* entries) {
  IdType previous;
  for (std::size_t left = s.Count(bytes_each); left > 0 && s.ok(); --left) {
    IdType id;
    s.Number(id.value);
    if (!id.valid() || (previous.valid() && !(previous < id))) {
      s.Fail("id " + std::to_string(id.value) + ", expected ids in ascending order");
    }
    Value value;
    fields(s, value);
    if (s.ok()) entries->Insert(id, std::move(value));
    previous = id;
  }
}

// Runs `read` on one section, which it must use up. Empty when that went well.
template <class Read>
std::string DecodeSection(const char* tag, const std::string& bytes, const Read& read) {
  ByteReader s(bytes);
  read(s);
  if (s.ok() && s.left() > 0) s.Fail("expected the end, " + std::to_string(s.left()) + " bytes follow");
  return s.ok() ? "" : std::string("section ") + tag + ": " + s.problem();
}

}  // namespace

Sections Encode(const Map& map, const CameraModel& camera) {
  std::array<ByteWriter, kTags.size()> s;
  CameraFields(s[0], camera);
  LensFields(s[0], camera);
  MapFields(s[1], map);
  WriteEntries<KeyframeId, Keyframe>(s[2], map.keyframes, KeyframeFields);
  WriteEntries<LandmarkId, Landmark>(s[3], map.landmarks, LandmarkFields);
  WriteLaser(s[4], map);
  return {s[0].bytes(), s[1].bytes(), s[2].bytes(), s[3].bytes(), s[4].bytes()};
}

Expected<SavedMap> Decode(const Sections& sections, std::uint32_t version) {
  SavedMap saved;
  Map& map = saved.map;
  const std::array<std::string, kTags.size()> problems = {
      DecodeSection(kTags[0], sections[0],
                    [&](ByteReader& s) {
                      CameraFields(s, saved.camera);
                      if (version > kVersionWithoutLens) LensFields(s, saved.camera);
                    }),
      DecodeSection(kTags[1], sections[1], [&](ByteReader& s) { MapFields(s, map); }),
      DecodeSection(kTags[2], sections[2],
                    [&](ByteReader& s) {
                      ReadEntries<KeyframeId, Keyframe>(s, kBytesPerKeyframe, KeyframeFields, &map.keyframes);
                    }),
      DecodeSection(kTags[3], sections[3],
                    [&](ByteReader& s) {
                      ReadEntries<LandmarkId, Landmark>(s, kBytesPerLandmark, LandmarkFields, &map.landmarks);
                    }),
      version > kVersionWithoutLaser ? DecodeSection(kTags[4], sections[4], [&](ByteReader& s) { ReadLaser(s, &map); })
                                     : ""};
  for (const std::string& problem : problems) {
    if (!problem.empty()) return Error{problem};
  }
  RebuildIndexes(&map);
  return saved;
}

}  // namespace planar_vslam::map_file
