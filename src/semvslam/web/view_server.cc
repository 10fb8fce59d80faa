#include "semvslam/web/view_server.h"

#include <fmt/core.h>
#include <httplib.h>
#include <sys/socket.h>

#include <atomic>
#include <charconv>
#include <future>
#include <optional>
#include <thread>
#include <utility>

#include "semvslam/web/live_feed.h"
#include "semvslam/web/page.h"
#include "semvslam/web/panel.h"

namespace semvslam {
namespace {

constexpr std::size_t kThreads = 32;
constexpr int kMostReaders = 24;  // of events: each occupies a thread
constexpr const char* kEventStream = "text/event-stream";

/// "generation:poses"
std::optional<LiveCursor> parse_cursor(const std::string& text) {
  LiveCursor at;
  const char* end = text.data() + text.size();
  const auto [colon, error] = std::from_chars(text.data(), end, at.generation);
  if (error != std::errc() || colon == end || *colon != ':') return std::nullopt;
  const auto [rest, second_error] = std::from_chars(colon + 1, end, at.poses);
  if (second_error != std::errc() || rest != end) return std::nullopt;
  return at;
}

void refuse(httplib::Response& response, int status, const std::string& why) {
  response.status = status;
  response.set_content(why + "\n", "text/plain; charset=utf-8");
}

}  // namespace

struct ViewServer::Parts {
  Parts(std::filesystem::path run_folder, ViewOptions options)
      : folder(std::move(run_folder)), view(std::move(options)), feed(folder) {}

  Result<Scene> scene() const {
    Scene out;
    out.live = feed.cursor();  // before the files are read: what comes meanwhile is then sent once more, not lost
    Result<ViewedRun> run = read_run(folder, view);
    if (!run) return run.error();
    out.runs.push_back(std::move(*run));
    out.in_truth_world = bring_together(out.runs);
    return out;
  }

  /// Answers with a part of the scene as it is now.
  void serve(const char* path, const char* type, std::string (*format)(const Scene&)) {
    server.Get(path, [this, type, format](const httplib::Request&, httplib::Response& response) {
      response.set_header("Cache-Control", "no-store");
      const Result<Scene> now = scene();
      if (now)
        response.set_content(format(*now), type);
      else
        refuse(response, 503, now.error().message);
    });
  }

  void serve_events() {
    server.Get("/events", [this](const httplib::Request& request, httplib::Response& response) {
      // After a broken connection the page's browser repeats the request and says how far it got.
      const std::string last = request.get_header_value("Last-Event-ID");
      const std::optional<LiveCursor> at = parse_cursor(last.empty() ? request.get_param_value("at") : last);
      if (!at) return refuse(response, 400, "at=GENERATION:POSES is missing");
      auto place = std::make_shared<ReaderPlace>(readers);
      if (place->taken > kMostReaders) return refuse(response, 503, "too many pages are open");
      response.set_header("Cache-Control", "no-store");
      response.set_chunked_content_provider(
          kEventStream, [this, place, reader = LiveFeed::Reader{*at}](std::size_t, httplib::DataSink& sink) mutable {
            const std::optional<std::string> news = feed.wait_for_news(reader);
            if (news)
              sink.write(news->data(), news->size());
            else
              sink.done();
            return true;
          });
    });
  }

  struct ReaderPlace {
    std::atomic<int>& readers;
    const int taken;
    explicit ReaderPlace(std::atomic<int>& all) : readers(all), taken(++all) {}
    ReaderPlace(const ReaderPlace&) = delete;
    ReaderPlace& operator=(const ReaderPlace&) = delete;
    ~ReaderPlace() { --readers; }
  };

  const std::filesystem::path folder;
  const ViewOptions view;
  LiveFeed feed;
  std::atomic<int> readers = 0;
  httplib::Server server;
  std::thread listener;
  std::string url;
};

Result<std::unique_ptr<ViewServer>> ViewServer::start(const std::filesystem::path& folder, ViewOptions view,
                                                      const ServerOptions& options) {
  view.live = true;
  if (const Result<ViewedRun> run = read_run(folder, view); !run) return run.error();
  auto parts = std::make_unique<Parts>(folder, std::move(view));
  httplib::Server& server = parts->server;
  // Without SO_REUSEPORT, which is the library's default: two servers on one port would take turns.
  server.set_socket_options([](socket_t socket) {
    const int yes = 1;
    ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  });
  server.set_keep_alive_max_count(1);  // a thread that waits for a second request would hold up the end
  parts->serve("/", "text/html; charset=utf-8", format_page);
  parts->serve("/scene.json", "application/json", format_scene);
  parts->serve("/panel.html", "text/html; charset=utf-8", [](const Scene& scene) { return format_panel(scene.runs); });
  parts->serve_events();
  const int port = options.port == 0                                    ? server.bind_to_any_port(options.address)
                   : server.bind_to_port(options.address, options.port) ? options.port
                                                                        : -1;
  if (port < 0)
    return Error{ErrorCode::kInvalidInput,
                 fmt::format("cannot serve at {}:{}: the port is taken or the address is not this machine's (--port 0 "
                             "takes one that is free)",
                             options.address, options.port)};
  const bool is_v6 = options.address.find(':') != std::string::npos;
  parts->url = fmt::format("http://{}:{}/", is_v6 ? "[" + options.address + "]" : options.address, port);
  // The server can be stopped once it has made its threads; before, stop() would do nothing.
  std::promise<void> ready;
  server.new_task_queue = [&ready] {
    ready.set_value();
    return new httplib::ThreadPool(kThreads);
  };
  parts->listener = std::thread([&server] { server.listen_after_bind(); });
  ready.get_future().wait();
  return std::unique_ptr<ViewServer>(new ViewServer(std::move(parts)));
}

ViewServer::ViewServer(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}

ViewServer::~ViewServer() {
  parts_->feed.stop();
  parts_->server.stop();
  parts_->listener.join();
}

const std::string& ViewServer::url() const { return parts_->url; }

void ViewServer::file_changed(const std::string& name) { parts_->feed.file_changed(name); }

}  // namespace semvslam
