#include "semvslam/data/sequence_writer.h"

#include <fmt/format.h>

#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "semvslam/data/camera_file.h"
#include "semvslam/data/file_io.h"
#include "semvslam/data/text_scan.h"

namespace semvslam {
namespace {

namespace fs = std::filesystem;

constexpr const char* kListHeader = "# timestamp filename\n";

Error invalid(const std::string& what) { return {ErrorCode::kInvalidInput, "cannot write the frame: " + what}; }

}  // namespace

SequenceWriter::SequenceWriter(fs::path folder, const Camera& camera, const SequenceWriterOptions& options)
    : folder_(std::move(folder)), camera_(camera), options_(options) {}

Result<SequenceWriter> SequenceWriter::create(const fs::path& folder, const Camera& camera,
                                              const SequenceWriterOptions& options) {
  if (Status s = camera.check(); !s) return s.error();
  SequenceWriter writer(folder, camera, options);
  if (Status s = writer.open_lists(); !s) return s.error();
  return writer;
}

Status SequenceWriter::open_lists() {
  std::error_code error;
  if (fs::exists(folder_ / "rgb.txt", error))
    return Error{ErrorCode::kInvalidInput, folder_.string() + ": holds a recording already; give another folder"};
  for (const char* name : {"rgb", "depth"})
    if (Status s = make_folder(folder_ / name); !s) return s;
  if (Status s = write_file_atomically(folder_ / "camera.yaml", format_camera(camera_)); !s) return s;
  for (const auto& [list, name] : {std::pair{&colour_list_, "rgb.txt"}, std::pair{&depth_list_, "depth.txt"}}) {
    Result<OutputFile> file = OutputFile::create(folder_ / name);
    if (!file) return file.error();
    *list = std::move(*file);
    if (Status s = list->write(kListHeader); !s) return s;
  }
  return Status::success();
}

Status SequenceWriter::check(const RgbdFrame& frame) const {
  const cv::Size size(camera_.width_px, camera_.height_px);
  const cv::Mat& picture = frame.colour.empty() ? frame.gray : frame.colour;
  if (picture.size() != size || frame.depth.size() != size || (!frame.mask.empty() && frame.mask.size() != size))
    return invalid("an image has another size than the camera");
  if (picture.type() != CV_8UC1 && picture.type() != CV_8UC3) return invalid("the picture must be 8-bit grey or BGR");
  if (frame.depth.type() != CV_16UC1) return invalid("depth must be 16-bit");
  if (!frame.mask.empty() && frame.mask.type() != CV_8UC1) return invalid("the mask must be 8-bit with one channel");
  if (last_stamp_ && frame.stamp <= *last_stamp_)
    return invalid("its time stamp " + format_seconds(frame.stamp) + " is not after the one before");
  return Status::success();
}

Status SequenceWriter::write_image(const std::string& file, const cv::Mat& image) {
  const std::vector<int> parameters = file.ends_with(".jpg")
                                          ? std::vector<int>{cv::IMWRITE_JPEG_QUALITY, options_.jpeg_quality}
                                          : std::vector<int>{cv::IMWRITE_PNG_COMPRESSION, options_.png_compression};
  std::vector<std::uint8_t> bytes;
  if (!cv::imencode(fs::path(file).extension().string(), image, bytes, parameters))
    return Error{ErrorCode::kInternal, (folder_ / file).string() + ": the image could not be encoded"};
  // Not imwrite: it does not tell that the disk is full.
  Result<OutputFile> out = OutputFile::create(folder_ / file);
  if (!out) return out.error();
  if (Status s = out->write({reinterpret_cast<const char*>(bytes.data()), bytes.size()}); !s) return s;
  return out->close();
}

Status SequenceWriter::write(const RgbdFrame& frame, const std::optional<SE3>& world_from_camera) {
  if (Status s = check(frame); !s) return s;
  const std::string stamp = format_seconds(frame.stamp);
  const std::string colour_file = "rgb/" + stamp + (options_.jpeg ? ".jpg" : ".png");
  const std::string depth_file = "depth/" + stamp + ".png";
  if (Status s = write_image(colour_file, frame.colour.empty() ? frame.gray : frame.colour); !s) return s;
  if (Status s = write_image(depth_file, frame.depth); !s) return s;
  if (!frame.mask.empty()) {
    if (Status s = make_folder(folder_ / "mask"); !s) return s;
    if (Status s = write_image("mask/" + stamp + ".png", frame.mask); !s) return s;
  }
  if (Status s = colour_list_.write(stamp + " " + colour_file + "\n"); !s) return s;
  if (Status s = depth_list_.write(stamp + " " + depth_file + "\n"); !s) return s;
  last_stamp_ = frame.stamp;
  if (!world_from_camera) return Status::success();
  if (!ground_truth_) {
    Result<AppendingTrajectoryWriter> file = AppendingTrajectoryWriter::create(folder_ / "groundtruth.txt");
    if (!file) return file.error();
    ground_truth_.emplace(std::move(*file));
  }
  return ground_truth_->append({frame.stamp, *world_from_camera});
}

}  // namespace semvslam
