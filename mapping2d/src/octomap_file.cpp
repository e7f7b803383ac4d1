#include "octomap_file.h"

#include <octomap/octomap.h>

#include <fstream>
#include <memory>
#include <sstream>

namespace planar_vslam {
namespace {

// OctoMap's .bt format: a text header, then two bits a node. OcTree::writeBinary does the same but talks on stderr.
bool WriteBinaryTree(octomap::OcTree& tree, std::ostream& out) {
  tree.toMaxLikelihood();
  tree.prune();
  out << "# Octomap OcTree binary file\nid " << tree.getTreeType() << "\nsize " << tree.size() << "\nres "
      << tree.getResolution() << "\ndata\n";
  if (tree.size() > 0) tree.writeBinaryData(out);
  return out.good();
}

std::unique_ptr<octomap::OcTree> MakeTree(const std::vector<OctomapVoxel>& voxels, double resolution,
                                          double occupied_threshold) {
  auto owned = std::make_unique<octomap::OcTree>(resolution);
  octomap::OcTree& tree = *owned;
  tree.setOccupancyThres(occupied_threshold);
  for (const OctomapVoxel& voxel : voxels) {
    const octomap::OcTreeKey key(static_cast<octomap::key_type>(voxel.at.x), static_cast<octomap::key_type>(voxel.at.y),
                                 static_cast<octomap::key_type>(voxel.at.z));
    tree.setNodeValue(key, voxel.log_odds, /*lazy_eval=*/true);
  }
  if (tree.getRoot() != nullptr) tree.updateInnerOccupancy();
  return owned;
}

}  // namespace

Expected<bool> WriteOctomapFile(const std::vector<OctomapVoxel>& voxels, double resolution, double occupied_threshold,
                                const std::filesystem::path& path) {
  const std::unique_ptr<octomap::OcTree> owned = MakeTree(voxels, resolution, occupied_threshold);
  octomap::OcTree& tree = *owned;
  std::ofstream file(path, std::ios::binary);
  const bool good = file && (path.extension() == ".ot" ? tree.write(file) : WriteBinaryTree(tree, file));
  if (!good || !file.flush()) {
    return Error{path.string() + ": cannot be written (is the folder there, and space left?)"};
  }
  return true;
}

std::string OctomapStream(const std::vector<OctomapVoxel>& voxels, double resolution, double occupied_threshold,
                          OctomapForm form) {
  if (voxels.empty()) return "";
  const std::unique_ptr<octomap::OcTree> tree = MakeTree(voxels, resolution, occupied_threshold);
  std::ostringstream out;
  if (form == OctomapForm::kFull) {
    tree->writeData(out);
  } else {
    tree->toMaxLikelihood();
    tree->prune();
    tree->writeBinaryData(out);
  }
  return out.str();
}

std::vector<OccupiedCube> OccupiedLeaves(const std::vector<OctomapVoxel>& voxels, double resolution,
                                         double occupied_threshold) {
  std::vector<OccupiedCube> cubes;
  if (voxels.empty()) return cubes;
  const std::unique_ptr<octomap::OcTree> tree = MakeTree(voxels, resolution, occupied_threshold);
  tree->toMaxLikelihood();
  tree->prune();
  for (auto leaf = tree->begin_leafs(); leaf != tree->end_leafs(); ++leaf) {
    if (!tree->isNodeOccupied(*leaf)) continue;
    const octomap::point3d center = leaf.getCoordinate();
    cubes.push_back({{center.x(), center.y(), center.z()}, static_cast<float>(leaf.getSize())});
  }
  return cubes;
}

}  // namespace planar_vslam
