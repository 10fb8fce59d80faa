// What a user may hand over by mistake: pictures and models that are damaged, odd, or not there.
#include <gmock/gmock.h>

#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "semvslam/base/temporary_folder_test_support.h"
#include "semvslam/semantic/network_graphs.h"
#include "semvslam/semantic/segmentation_files.h"
#include "semvslam/semantic/segmenter.h"

namespace semvslam {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

const fs::path kShippedModels = fs::path(SEMVSLAM_SOURCE_DIR) / "models";

class BadInput : public ::testing::TestWithParam<std::string> {
 protected:
  /// A copy of the shipped network to be damaged.
  void copy_model() const {
    for (const char* name :
         {"model.json", "trunk.onnx", "box.onnx", "mask.onnx", "refine.onnx", "trunk.int8.xml", "trunk.int8.bin"})
      fs::copy_file(kShippedModels / name, folder_ / name, fs::copy_options::overwrite_existing);
  }
  void edit_model(const std::function<void(nlohmann::json&)>& edit) const {
    std::ifstream in(kShippedModels / "model.json");
    nlohmann::json model = nlohmann::json::parse(in);
    edit(model);
    std::ofstream(folder_ / "model.json") << model.dump();
  }
  Result<std::unique_ptr<Segmenter>> make(const fs::path& model, const std::string& precision = "f32") const {
    SegmenterOptions options;
    options.model = model.string();
    options.backend = GetParam();
    options.precision = precision;
    return make_segmenter(options, RoleTable());
  }
  const testing_support::TemporaryFolder folder_;
};

TEST_P(BadInput, AModelThatIsMissingOrCutOffIsNamed) {
  if (GetParam() == "openvino" && !have_openvino()) GTEST_SKIP() << "built without OpenVINO";
  const std::pair<const char*, std::uintmax_t> cuts[] = {
      {"trunk.onnx", 4'000'000}, {"trunk.onnx", 0}, {"mask.onnx", 100}, {"refine.onnx", 5000}};
  for (const auto& [graph, bytes] : cuts) {
    copy_model();
    fs::resize_file(folder_ / graph, bytes);
    const auto cut = make(folder_.path());
    ASSERT_FALSE(cut) << graph << " of " << bytes << " bytes";
    EXPECT_THAT(cut.error().message, HasSubstr(graph));
  }
  if (GetParam() == "openvino") {
    copy_model();
    fs::resize_file(folder_ / "trunk.int8.xml", 1000);
    const auto cut = make(folder_.path(), "int8");
    ASSERT_FALSE(cut);
    EXPECT_THAT(cut.error().message, HasSubstr("trunk.int8.xml"));
  }
  fs::remove(folder_ / "box.onnx");
  const auto missing = make(folder_.path());
  ASSERT_FALSE(missing);
  EXPECT_THAT(missing.error().message, AllOf(HasSubstr("model.json"), HasSubstr("box.onnx")));
}

TEST_P(BadInput, AGraphOfAnotherShapeIsNamedWithItsTensor) {
  if (GetParam() == "openvino" && !have_openvino()) GTEST_SKIP() << "built without OpenVINO";
  copy_model();
  edit_model([](nlohmann::json& m) { m["feature_channels"] = 64; });
  const auto thinner = make(folder_.path());
  ASSERT_FALSE(thinner);
  EXPECT_THAT(thinner.error().message, HasSubstr("'p3'"));
  edit_model([](nlohmann::json& m) { m["classes"] = {"person", "cup"}; });
  const auto fewer = make(folder_.path());
  ASSERT_FALSE(fewer);
  EXPECT_THAT(fewer.error().message, HasSubstr("'probabilities'"));
}

TEST_P(BadInput, OddPicturesGiveAnEmptyResult) {
  if (GetParam() == "openvino" && !have_openvino()) GTEST_SKIP() << "built without OpenVINO";
  const auto segmenter = make("");
  ASSERT_TRUE(segmenter) << segmenter.error().message;
  std::vector<cv::Mat> pictures{cv::Mat(1, 1, CV_8UC3, cv::Scalar::all(7)), cv::Mat(480, 640, CV_8UC1, cv::Scalar(90)),
                                cv::Mat(48, 64, CV_16UC1, cv::Scalar(9000)),
                                cv::Mat(33, 17, CV_8UC4, cv::Scalar::all(50))};
  if (GetParam() == "openvino") pictures.emplace_back(3648, 5472, CV_8UC3, cv::Scalar::all(30));
  for (const cv::Mat& image : pictures) {
    const auto s = (*segmenter)->segment({FrameId(0), TimeStamp{}, image, ""});
    ASSERT_TRUE(s) << s.error().message;
    EXPECT_EQ(s->size, image.size());
    EXPECT_THAT(s->instances, ::testing::IsEmpty());  // nothing is to be seen in them
  }
  EXPECT_FALSE((*segmenter)->segment({FrameId(0), TimeStamp{}, cv::Mat(), ""}));
  EXPECT_FALSE((*segmenter)->segment({FrameId(0), TimeStamp{}, cv::Mat(9, 9, CV_32FC1, cv::Scalar(0)), ""}));
}

INSTANTIATE_TEST_SUITE_P(Backends, BadInput, ::testing::Values("openvino", "opencv"),
                         [](const auto& about) { return about.param; });

TEST(ReadPicture, FilesThatAreNoPictureAreNamed) {
  const testing_support::TemporaryFolder folder;
  const fs::path file = folder / "picture.png";
  const auto refused = [&] {
    const Result<cv::Mat> picture = read_picture(file);
    return !picture && picture.error().message.find(file.filename().string()) != std::string::npos;
  };
  EXPECT_TRUE(refused());  // not there
  std::ofstream(file).flush();
  EXPECT_TRUE(refused());  // 0 bytes
  std::ofstream(file) << "no picture";
  EXPECT_TRUE(refused());
  std::vector<std::uint8_t> bytes;
  cv::imencode(".png", cv::Mat(40, 40, CV_8UC3, cv::Scalar::all(99)), bytes);
  std::ofstream(file, std::ios::binary).write(reinterpret_cast<const char*>(bytes.data()), 40);  // the header only
  EXPECT_TRUE(refused());
}

TEST(ReadPicture, EveryUsualTypeBecomesColour) {
  const testing_support::TemporaryFolder folder;
  const fs::path file = folder / "picture.png";
  for (const int type : {CV_8UC1, CV_16UC1, CV_8UC3, CV_16UC3, CV_8UC4}) {
    cv::imwrite(file.string(), cv::Mat(6, 9, type, cv::Scalar::all(CV_MAT_DEPTH(type) == CV_16U ? 50 * 256 : 50)));
    const Result<cv::Mat> picture = read_picture(file);
    ASSERT_TRUE(picture) << picture.error().message;
    EXPECT_EQ(cv::norm(*picture, cv::Mat(6, 9, CV_8UC3, cv::Scalar::all(50)), cv::NORM_INF), 0) << type;
  }
}

}  // namespace
}  // namespace semvslam
