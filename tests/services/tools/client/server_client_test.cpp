#include "services/tools/client/server_client.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/tools/client/camera_client.h"
#include "tests/services/tools/client/answering_daemon.h"
#include "weft/v1/cameras.grpc.pb.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class ServerClientTest : public ::testing::Test {
 protected:
  absl::Status Drain() {
    return client_.DrainUntilItStops(v1::DrainRequest(), [this](const v1::DrainProgress& progress) {
      running_.push_back(progress.tasks_running());
    });
  }

  AnsweringDaemon daemon_;
  ServerClient client_{daemon_.client()};
  std::vector<int> running_;
};

TEST_F(ServerClientTest, DrainsUntilTheDaemonIsGone) {
  int left = 2;
  daemon_.info.drain = [&](const v1::DrainRequest&, v1::DrainProgress* progress) {
    progress->set_tasks_running(left);
    return left-- > 0 ? grpc::Status::OK : BrokenOff();
  };
  EXPECT_TRUE(Drain().ok());
  EXPECT_THAT(running_, ElementsAre(2, 1));
  running_.clear();
  left = 1;
  daemon_.info.drain = [&](const v1::DrainRequest&, v1::DrainProgress*) {
    return left-- > 0 ? grpc::Status::OK : grpc::Status::CANCELLED;
  };
  EXPECT_TRUE(Drain().ok());
}

TEST_F(ServerClientTest, TellsADrainThatDidNotBegin) {
  daemon_.info.drain = [](const v1::DrainRequest&, v1::DrainProgress*) { return BrokenOff(); };
  EXPECT_EQ(Drain(), absl::UnavailableError("the daemon is shutting down"));
  EXPECT_THAT(running_, IsEmpty());
  int calls = 0;
  daemon_.info.drain = [&](const v1::DrainRequest&, v1::DrainProgress*) {
    return ++calls < 2 ? grpc::Status::OK : grpc::Status(grpc::StatusCode::PERMISSION_DENIED, "not yours");
  };
  EXPECT_TRUE(absl::IsPermissionDenied(Drain()));
}

class AnsweringCameras final : public v1::Cameras::Service {
 public:
  grpc::Status end;  // of a look

 private:
  grpc::Status ListCameras(grpc::ServerContext*, const v1::ListCamerasRequest*,
                           v1::CameraList* out) override {
    out->add_cameras()->set_device("/dev/video0");
    return grpc::Status::OK;
  }
  grpc::Status LookAtCameras(grpc::ServerContext*, const v1::LookAtCamerasRequest* request,
                             grpc::ServerWriter<v1::CameraLook>* out) override {
    for (uint64_t set = 0; set < 2; ++set) {
      v1::CameraLook look;
      look.set_set(set);
      look.set_problem(request->take_id());
      out->Write(look);
    }
    return end;
  }
};

TEST(CameraClient, ListsAndLooks) {
  AnsweringCameras cameras;
  const AnsweringDaemon daemon({&cameras});
  CameraClient client(daemon.client());
  EXPECT_EQ(client.List()->cameras(0).device(), "/dev/video0");
  v1::LookAtCamerasRequest request;
  request.set_take_id("t1");
  const auto looks = client.Look(request);
  ASSERT_TRUE(looks.ok()) << looks.status();
  ASSERT_EQ(looks->size(), 2u);
  EXPECT_EQ((*looks)[1].set(), 1u);
  EXPECT_EQ((*looks)[1].problem(), "t1");
  cameras.end = grpc::Status(grpc::StatusCode::NOT_FOUND, "no take t1");
  EXPECT_EQ(client.Look(request).status(), absl::NotFoundError("no take t1"));
}

TEST_F(ServerClientTest, RehearsesRetentionOnce) {
  int calls = 0;
  daemon_.info.rehearse = [&](const v1::RehearseRetentionRequest& request, v1::RetentionRehearsal* answer) {
    ++calls;
    answer->set_seen_days(2 * request.ahead_days());
    return calls == 1 ? grpc::Status::OK : BrokenOff();
  };
  v1::RehearseRetentionRequest request;
  request.set_ahead_days(3);
  EXPECT_EQ(client_.RehearseRetention(request)->seen_days(), 6);
  EXPECT_EQ(client_.RehearseRetention(request).status(),
            absl::UnavailableError("the daemon is shutting down"));
  EXPECT_EQ(calls, 2);
}

}  // namespace
}  // namespace weft
