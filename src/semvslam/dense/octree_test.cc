#include "semvslam/dense/octree.h"

#include <gmock/gmock.h>
#include <octomap/octomap.h>

#include <map>
#include <memory>
#include <random>
#include <sstream>
#include <vector>

namespace semvslam {
namespace {

constexpr double kLeaf_m = 0.05;

OctreeCode code(int x, int y, int z) { return octree_code({x, y, z}).value(); }

std::vector<OctreeLeaf> leaves_of(const std::map<OctreeCode, bool>& occupied) {
  std::vector<OctreeLeaf> leaves;
  for (const auto& [code, is_occupied] : occupied) leaves.push_back({code, is_occupied});
  return leaves;
}

/// What the format's own library reads in a file; null where it finds none.
std::unique_ptr<octomap::OcTree> read(const std::string& file, bool binary) {
  std::istringstream in(file);
  if (!binary)
    return std::unique_ptr<octomap::OcTree>(dynamic_cast<octomap::OcTree*>(octomap::AbstractOcTree::read(in)));
  auto tree = std::make_unique<octomap::OcTree>(1.);
  return tree->readBinary(in) ? std::move(tree) : nullptr;
}

std::string data_of(const std::string& file) { return file.substr(file.find("\ndata\n") + 6); }

/// Some hundred cubes in a clump and a filled block of 4 x 4 x 4, around the origin, and one far away.
std::map<OctreeCode, bool> some_cubes() {
  std::map<OctreeCode, bool> cubes;
  std::mt19937 random(1);
  const auto number = [&] { return static_cast<int>(random() % 12) - 6; };
  for (int k = 0; k < 500; ++k) {
    const int x = number(), y = number(), z = number();
    cubes[code(x, y, z)] = random() % 2 == 0;
  }
  for (int k = 0; k < 64; ++k) cubes[code(8 + k % 4, 4 + k / 4 % 4, -8 + k / 16)] = false;
  cubes[code(-kOctreeReach, kOctreeReach - 1, 1000)] = true;
  return cubes;
}

TEST(Octree, OctoMapFindsEveryCubeInItsPlace) {
  const std::map<OctreeCode, bool> cubes = some_cubes();
  const std::vector<OctreeLeaf> leaves = leaves_of(cubes);
  for (const bool binary : {true, false}) {
    const auto tree = read(binary ? format_bt(leaves, kLeaf_m) : format_ot(leaves, kLeaf_m), binary);
    ASSERT_NE(tree, nullptr);
    EXPECT_EQ(tree->getResolution(), kLeaf_m);
    for (int x = -10; x < 14; ++x)
      for (int y = -10; y < 14; ++y)
        for (int z = -10; z < 14; ++z) {
          const auto known = cubes.find(code(x, y, z));
          const octomap::OcTreeNode* node = tree->search((x + .5) * kLeaf_m, (y + .5) * kLeaf_m, (z + .5) * kLeaf_m);
          ASSERT_EQ(node != nullptr, known != cubes.end());
          if (node != nullptr) {
            ASSERT_EQ(tree->isNodeOccupied(node), known->second);
            ASSERT_TRUE(tree->isNodeAtThreshold(node));
          }
        }
    tree->expand();
    EXPECT_EQ(tree->getNumLeafNodes(), cubes.size());
  }
}

TEST(Octree, TheBytesAreThoseThatOctoMapWritesOfTheSameTree) {
  const std::vector<OctreeLeaf> leaves = leaves_of(some_cubes());
  const auto tree = read(format_ot(leaves, kLeaf_m), false);
  ASSERT_NE(tree, nullptr);
  tree->expand();
  tree->prune();
  std::ostringstream binary, full;
  ASSERT_TRUE(tree->writeBinaryConst(binary));
  ASSERT_TRUE(tree->write(full));
  EXPECT_EQ(data_of(format_bt(leaves, kLeaf_m)), data_of(binary.str()));
  EXPECT_EQ(data_of(format_ot(leaves, kLeaf_m)), data_of(full.str()));
  EXPECT_THAT(format_bt(leaves, kLeaf_m), testing::HasSubstr("\nsize " + std::to_string(tree->size()) + "\n"));
}

TEST(Octree, EqualCubesThatFillALargerOneAreOne) {
  std::map<OctreeCode, bool> block;
  for (int k = 0; k < 64; ++k) block[code(k % 4, k / 4 % 4, k / 16)] = true;
  const auto whole = read(format_bt(leaves_of(block), kLeaf_m), true);
  ASSERT_NE(whole, nullptr);
  EXPECT_EQ(whole->getNumLeafNodes(), 1u);
  block[code(0, 0, 0)] = false;
  const auto with_hole = read(format_bt(leaves_of(block), kLeaf_m), true);
  ASSERT_NE(with_hole, nullptr);
  EXPECT_EQ(with_hole->getNumLeafNodes(), 15u);
}

TEST(Octree, NothingKnownIsATreeToo) {
  const auto binary = read(format_bt({}, kLeaf_m), true);
  ASSERT_NE(binary, nullptr);
  EXPECT_EQ(binary->size(), 0u);
  const auto full = read(format_ot({}, kLeaf_m), false);
  ASSERT_NE(full, nullptr);
  EXPECT_EQ(full->size(), 0u);
}

TEST(Octree, CubesOutsideTheTreeHaveNoCode) {
  EXPECT_TRUE(octree_code({kOctreeReach - 1, -kOctreeReach, 0}));
  EXPECT_FALSE(octree_code({kOctreeReach, 0, 0}));
  EXPECT_FALSE(octree_code({0, 0, -kOctreeReach - 1}));
}

}  // namespace
}  // namespace semvslam
