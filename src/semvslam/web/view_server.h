#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "semvslam/base/result.h"
#include "semvslam/web/viewed_run.h"

namespace semvslam {

struct ServerOptions {
  std::string address = "127.0.0.1";  // only this machine can reach it
  int port = 8765;                    // 0 = any that is free
};

/// Serves the page of one run, and tells pages what changes in its folder. Threads of its own answer requests.
class ViewServer {
 public:
  /// @param view `live` is set here. Errors: no such folder, an address or port that cannot be had.
  static Result<std::unique_ptr<ViewServer>> start(const std::filesystem::path& folder, ViewOptions view,
                                                   const ServerOptions& options);
  ~ViewServer();  // open connections are ended

  /// Where the page is: "http://127.0.0.1:8765/".
  const std::string& url() const;
  /// A file of the folder changed (see FolderWatch::changed()).
  void file_changed(const std::string& name);

 private:
  struct Parts;
  explicit ViewServer(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace semvslam
