#include "semvslam/download/unpack.h"

#include <archive.h>
#include <archive_entry.h>
#include <fmt/format.h>
#include <openssl/evp.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>
#include <system_error>
#include <utility>
#include <vector>

namespace semvslam {
namespace fs = std::filesystem;

namespace {

using Reader = std::unique_ptr<archive, int (*)(archive*)>;

Error stopped(const fs::path& file) { return {ErrorCode::kIo, fmt::format("{}: stopped", file.string())}; }

/// A folder that goes with the object, unless it was given its name.
class UnfinishedFolder {
 public:
  explicit UnfinishedFolder(fs::path path) : path_(std::move(path)) {
    std::error_code ec;
    fs::remove_all(path_, ec);  // of an earlier call that was killed
    fs::create_directories(path_, error_);
  }
  ~UnfinishedFolder() {
    std::error_code ec;
    fs::remove_all(path_, ec);
  }
  UnfinishedFolder(const UnfinishedFolder&) = delete;
  UnfinishedFolder& operator=(const UnfinishedFolder&) = delete;
  const fs::path& path() const { return path_; }
  const std::error_code& error() const { return error_; }

 private:
  fs::path path_;
  std::error_code error_;
};

class Unpacker {
 public:
  Unpacker(const fs::path& file, const fs::path& into, const std::string& folder, const UnpackProgress& progress)
      : file_(file), into_(into), folder_(folder), progress_(progress) {}

  Status run() {
    const Reader reader(archive_read_new(), &archive_read_free);
    archive_read_support_filter_all(reader.get());
    archive_read_support_format_tar(reader.get());
    archive_read_support_format_zip(reader.get());
    constexpr std::size_t kBlockBytes = 1 << 18;
    if (archive_read_open_filename(reader.get(), file_.c_str(), kBlockBytes) != ARCHIVE_OK) return damaged(reader);
    const Reader writer(archive_write_disk_new(), &archive_write_free);
    archive_write_disk_set_options(
        writer.get(), ARCHIVE_EXTRACT_TIME | ARCHIVE_EXTRACT_SECURE_NODOTDOT | ARCHIVE_EXTRACT_SECURE_SYMLINKS);
    for (;;) {
      archive_entry* entry = nullptr;
      const int code = archive_read_next_header(reader.get(), &entry);
      if (code == ARCHIVE_EOF) break;
      if (code != ARCHIVE_OK) return damaged(reader);
      if (Status status = take(reader, writer, entry); !status) return status;
    }
    if (archive_write_close(writer.get()) != ARCHIVE_OK) return cannot_write(writer);
    std::error_code ec;
    if (!fs::is_directory(into_ / folder_, ec)) return foreign("nothing");
    return Status::success();
  }

 private:
  Status take(const Reader& reader, const Reader& writer, archive_entry* entry) {
    const char* name = archive_entry_pathname_utf8(entry);
    const fs::path path = fs::path(name != nullptr ? name : "").lexically_normal();
    // "./" of archives that were made of a whole folder.
    if (path == "." || path == "./") return Status::success();
    if (path.is_absolute() || path.empty() || *path.begin() != folder_) return foreign(path.string());
    const auto type = archive_entry_filetype(entry);
    if ((type != AE_IFREG && type != AE_IFDIR) || archive_entry_hardlink(entry) != nullptr)
      return foreign(path.string() + ", which is no file,");
    archive_entry_set_pathname(entry, (into_ / path).c_str());
    archive_entry_set_perm(entry, type == AE_IFDIR ? 0755 : 0644);  // some archives forbid their owner to read
    if (archive_write_header(writer.get(), entry) != ARCHIVE_OK) return cannot_write(writer);
    for (;;) {
      const void* data = nullptr;
      std::size_t size = 0;
      la_int64_t offset = 0;
      const int code = archive_read_data_block(reader.get(), &data, &size, &offset);
      if (!progress_(static_cast<std::uint64_t>(archive_filter_bytes(reader.get(), -1)))) return stopped(file_);
      if (code == ARCHIVE_EOF) break;
      if (code != ARCHIVE_OK) return damaged(reader);
      if (archive_write_data_block(writer.get(), data, size, offset) != ARCHIVE_OK) return cannot_write(writer);
    }
    if (archive_write_finish_entry(writer.get()) != ARCHIVE_OK) return cannot_write(writer);
    return Status::success();
  }

  Error damaged(const Reader& reader) const {
    const char* why = archive_error_string(reader.get());
    return invalid_input(fmt::format("{}: a damaged archive, or none: {}", file_.string(), why != nullptr ? why : "?"));
  }
  Error cannot_write(const Reader& writer) const {
    const char* why = archive_error_string(writer.get());
    return {ErrorCode::kIo, fmt::format("{}: cannot be unpacked: {}", file_.string(), why != nullptr ? why : "?")};
  }
  Error foreign(const std::string& what) const {
    return invalid_input(
        fmt::format("{}: should hold the folder {} and nothing else; it holds {}", file_.string(), folder_, what));
  }

  const fs::path& file_;
  const fs::path& into_;
  const std::string& folder_;
  const UnpackProgress& progress_;
};

}  // namespace

Status unpack(const fs::path& archive, const fs::path& parent, const std::string& folder,
              const UnpackProgress& progress) {
  std::error_code ec;
  const fs::path target = parent / folder;
  if (fs::exists(target, ec)) return Error{ErrorCode::kIo, fmt::format("{}: is there already", target.string())};
  const UnfinishedFolder unfinished(parent / ("." + folder + ".unfinished"));
  if (unfinished.error())
    return Error{ErrorCode::kIo, fmt::format("{}: {}", unfinished.path().string(), unfinished.error().message())};
  // Absolute: libarchive's guard against symbolic links looks at each folder on the way.
  const fs::path into = fs::canonical(unfinished.path(), ec);
  if (Status status = Unpacker(archive, into, folder, progress).run(); !status) return status;
  fs::rename(into / folder, target, ec);
  if (ec) return Error{ErrorCode::kIo, fmt::format("{}: {}", target.string(), ec.message())};
  return Status::success();
}

Result<std::string> sha256_of_file(const fs::path& file, const UnpackProgress& progress) {
  std::ifstream in(file, std::ios::binary);
  const std::unique_ptr<EVP_MD_CTX, void (*)(EVP_MD_CTX*)> context(EVP_MD_CTX_new(), &EVP_MD_CTX_free);
  if (!context || EVP_DigestInit_ex(context.get(), EVP_sha256(), nullptr) != 1)
    return Error{ErrorCode::kInternal, "SHA-256 cannot be computed"};
  std::vector<char> block(1 << 20);
  std::uint64_t read = 0;
  while (in.read(block.data(), static_cast<std::streamsize>(block.size())) || in.gcount() > 0) {
    const auto count = static_cast<std::size_t>(in.gcount());
    EVP_DigestUpdate(context.get(), block.data(), count);
    read += count;
    if (!progress(read)) return stopped(file);
  }
  if (!in.eof()) return Error{ErrorCode::kIo, fmt::format("{}: cannot be read", file.string())};
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int size = 0;
  EVP_DigestFinal_ex(context.get(), digest.data(), &size);
  std::string out;
  for (unsigned int i = 0; i < size; ++i) out += fmt::format("{:02x}", digest[i]);
  return out;
}

}  // namespace semvslam
