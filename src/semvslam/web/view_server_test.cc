#include "semvslam/web/view_server.h"

#include <gmock/gmock.h>
#include <httplib.h>

#include <fstream>
#include <future>
#include <thread>

#include "semvslam/web/run_folder_test_support.h"

namespace semvslam {
namespace {

using testing::HasSubstr;
using testing_support::RunFolder;
using testing_support::write;

class ViewServerTest : public ::testing::Test {
 protected:
  void SetUp() override {
    ServerOptions options;
    options.port = 0;
    Result<std::unique_ptr<ViewServer>> server = ViewServer::start(folder_.path(), {}, options);
    ASSERT_TRUE(server) << server.error().message;
    server_ = std::move(*server);
  }
  std::string address() const { return server_->url().substr(0, server_->url().size() - 1); }
  httplib::Result get(const std::string& path) const { return httplib::Client(address()).Get(path.c_str()); }

  RunFolder folder_;
  std::unique_ptr<ViewServer> server_;
};

TEST_F(ViewServerTest, ServesThePageAndItsParts) {
  const httplib::Result page = get("/");
  ASSERT_TRUE(page);
  EXPECT_EQ(page->status, 200);
  EXPECT_THAT(page->body, HasSubstr("connect-src 'self'"));
  EXPECT_THAT(get("/scene.json")->body, HasSubstr("\"live\":{\"generation\":1,\"poses\":20}"));
  EXPECT_THAT(get("/panel.html")->body, HasSubstr("20 of 20"));
  EXPECT_EQ(get("/etc/passwd")->status, 404);
  EXPECT_EQ(get("/events?at=x")->status, 400);
}

TEST_F(ViewServerTest, AFolderThatWasDamagedMeanwhileIsSaid) {
  write(folder_ / "trajectory.txt", "foreign\n");
  EXPECT_EQ(get("/")->status, 503);
  EXPECT_THAT(get("/")->body, HasSubstr("trajectory.txt:1"));
}

TEST_F(ViewServerTest, StreamsAPoseThatIsAppended) {
  std::string events;
  bool appended = false;
  httplib::Client client(address());
  client.Get("/events?at=1:20", [&](const char* data, std::size_t size) {
    events.append(data, size);
    if (!appended) {  // the stream has begun
      std::ofstream(folder_ / "trajectory.txt", std::ios::app) << "99 1 2 3 0 0 0 1\n";
      server_->file_changed("trajectory.txt");
      appended = true;
    }
    return events.find("event: poses") == std::string::npos;
  });
  EXPECT_THAT(events, HasSubstr("id: 1:21\ndata: [[98.000000,1,2,3,0,0,0,1]]"));
}

TEST_F(ViewServerTest, EndsWhileAPageListens) {
  std::thread listening;
  {
    std::promise<void> begun;
    listening = std::thread([&, url = address()] {
      bool first = true;
      httplib::Client(url).Get("/events?at=1:20", [&](const char*, std::size_t) {
        if (first) begun.set_value();
        first = false;
        return true;
      });
    });
    begun.get_future().wait();
    server_.reset();
  }
  listening.join();
}

TEST_F(ViewServerTest, APortThatIsTakenIsAnError) {
  ServerOptions taken;
  taken.port = std::stoi(server_->url().substr(server_->url().rfind(':') + 1));
  const Result<std::unique_ptr<ViewServer>> second = ViewServer::start(folder_.path(), {}, taken);
  ASSERT_FALSE(second);
  EXPECT_THAT(second.error().message, HasSubstr("the port is taken"));
}

TEST_F(ViewServerTest, AForeignAddressAndAMissingFolderAreErrors) {
  ServerOptions foreign;
  foreign.address = "192.0.2.1";  // of documentation, RFC 5737
  EXPECT_FALSE(ViewServer::start(folder_.path(), {}, foreign));
  EXPECT_THAT(ViewServer::start(folder_ / "none", {}, {}).error().message, HasSubstr("no such folder"));
}

}  // namespace
}  // namespace semvslam
