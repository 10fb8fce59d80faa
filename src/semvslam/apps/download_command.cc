#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "semvslam/apps/command.h"
#include "semvslam/apps/interrupt.h"
#include "semvslam/apps/progress.h"
#include "semvslam/data/file_io.h"
#include "semvslam/data/sequence.h"
#include "semvslam/download/fetch.h"
#include "semvslam/download/public_recordings.h"
#include "semvslam/download/unpack.h"

namespace semvslam {
namespace fs = std::filesystem;

namespace {

struct DownloadArguments {
  std::string dataset, to = ".", mirror;
  std::vector<std::string> names;
  bool list = false, keep_archive = false, skip_checksum = false, quiet = false;
};

constexpr std::uint64_t kMegabyte = 1'000'000;

/// Progress in megabytes, of a total that shows only while it goes on. Says no once the user wants it to end.
class Megabytes {
 public:
  Megabytes(std::string note, bool quiet) : note_(std::move(note)), quiet_(quiet) {}
  bool operator()(std::uint64_t done_bytes, std::optional<std::uint64_t> total_bytes) {
    if (!line_) line_.emplace(total_bytes ? std::optional(*total_bytes / kMegabyte) : std::nullopt, quiet_, "MB");
    line_->update(done_bytes / kMegabyte, note_);
    return InterruptGuard::received() == 0;
  }

 private:
  std::string note_;
  bool quiet_;
  std::optional<Progress> line_;
};

int list() {
  for (const PublicDataset& dataset : public_datasets()) {
    fmt::print("{}: {}\n", dataset.name, dataset.about);
    for (const PublicRecording& r : dataset.recordings)
      fmt::print("  {:<38} {}{}\n", r.short_name, r.folder, r.sha256.empty() ? "" : "  (checksum known)");
    if (!dataset.group.empty()) fmt::print("  {:<38} the {} of the paper\n", dataset.group, dataset.group_names.size());
  }
  return kExitSuccess;
}

/// Fetches the archive, unless an earlier call did and could not unpack it.
Status fetch_archive(const PublicRecording& recording, const DownloadArguments& a, const fs::path& archive) {
  std::error_code ec;
  if (fs::exists(archive, ec)) return Status::success();
  const std::string url = (a.mirror.empty() ? recording.base_url : a.mirror) + "/" + recording.archive;
  if (!a.quiet) fmt::print("{}\n", url);
  Megabytes progress("fetched", a.quiet);
  return fetch(url, archive, [&](std::uint64_t done, std::optional<std::uint64_t> all) { return progress(done, all); });
}

/// What the archive should be by its checksum, where that is known.
Status check_archive(const PublicRecording& recording, const DownloadArguments& a, const fs::path& archive) {
  std::error_code ec;
  const std::uint64_t size = fs::file_size(archive, ec);
  Megabytes progress("checked", a.quiet);
  const Result<std::string> sum = sha256_of_file(
      archive, [&](std::uint64_t done) { return progress(done, ec ? std::nullopt : std::optional(size)); });
  if (!sum) return sum.error();
  if (recording.sha256.empty() || a.skip_checksum) {
    if (!a.quiet) fmt::print("SHA-256 {}{}\n", *sum, recording.sha256.empty() ? ", of which none is known" : "");
    return Status::success();
  }
  if (*sum == recording.sha256) return Status::success();
  return invalid_input(
      fmt::format("{}: its SHA-256 is {}, not {}: damaged, or its makers have changed it "
                  "(--skip-checksum takes it)",
                  archive.string(), *sum, recording.sha256));
}

Status unpack_archive(const PublicRecording& recording, const DownloadArguments& a, const fs::path& archive) {
  std::error_code ec;
  const std::uint64_t size = fs::file_size(archive, ec);
  Megabytes progress("unpacked", a.quiet);
  return unpack(archive, a.to, recording.folder,
                [&](std::uint64_t done) { return progress(done, ec ? std::nullopt : std::optional(size)); });
}

/// One recording as a folder that `run` reads. What has come of an archive stays for the next call; one that is
/// damaged goes.
Status download_one(const PublicRecording& recording, const DownloadArguments& a) {
  std::error_code ec;
  const fs::path folder = fs::path(a.to) / recording.folder, archive = fs::path(a.to) / recording.archive;
  if (fs::exists(folder, ec)) {
    if (!a.quiet) fmt::print("{}: is there already\n", folder.string());
    return Status::success();
  }
  Status done = fetch_archive(recording, a, archive);
  if (!done) return done;
  done = check_archive(recording, a, archive);
  if (done) done = unpack_archive(recording, a, archive);
  if (!done) {
    if (done.error().code == ErrorCode::kInvalidInput) fs::remove(archive, ec);
    return done;
  }
  if (!a.keep_archive) fs::remove(archive, ec);
  const Result<std::unique_ptr<FrameSource>> source = open_sequence(folder, {});
  if (!source) return source.error();
  if (!a.quiet) fmt::print("{}: {}\n", folder.string(), (*source)->description());
  return Status::success();
}

Result<int> download(const DownloadArguments& a) {
  if (a.list) return list();
  if (a.dataset.empty() || a.names.empty())
    return invalid_input(
        "download needs a dataset and a recording, as in: semvslam download tum fr3_walking_xyz (--list)");
  std::vector<PublicRecording> wanted;
  for (const std::string& name : a.names) {
    Result<std::vector<PublicRecording>> found = find_public_recordings(a.dataset, name);
    if (!found) return found.error();
    wanted.insert(wanted.end(), found->begin(), found->end());
  }
  if (const Status status = make_folder(a.to); !status) return status.error();
  const InterruptGuard guard;
  for (const PublicRecording& recording : wanted) {
    const Status status = download_one(recording, a);
    if (const int signal = InterruptGuard::received(); signal != 0) {
      fmt::print(stderr, "semvslam: stopped; the same command goes on from here\n");
      return 128 + signal;
    }
    if (!status) return status.error();
  }
  return static_cast<int>(kExitSuccess);
}

}  // namespace

CommandHandler setup_download(CLI::App& parser) {
  auto a = std::make_shared<DownloadArguments>();
  parser.add_option("DATASET", a->dataset, "tum or bonn");
  parser.add_option("NAME", a->names,
                    "recordings as fr3_walking_xyz or by their folder's name; paper: tum's eight with people");
  parser.add_option("--to", a->to, "folder for the recordings' folders; made when missing")->capture_default_str();
  parser.add_option("--mirror", a->mirror,
                    "where the archives are instead of their makers' server: a URL (file:// too)");
  parser.add_flag("--keep-archive", a->keep_archive, "do not remove the archive after unpacking");
  parser.add_flag("--skip-checksum", a->skip_checksum, "take an archive also where its checksum is not the known one");
  parser.add_flag("--list", a->list, "show what there is");
  parser.add_flag("--quiet", a->quiet, "no progress and no names on the terminal");
  return [a] { return download(*a); };
}

}  // namespace semvslam
