// A garment's equations of motion: implicit Euler with contacts.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <functional>
#include <memory>
#include <vector>

#include "figure/body.h"
#include "physics/cloth_contacts.h"
#include "physics/fabric.h"

namespace weft {

// A solid that cloth cannot enter, at the end of a step.
struct Obstacle {
  std::function<SurfaceDistance(const Eigen::Vector3d& p_mm, double far_mm)> distance;
  // Velocity of its surface near a point.
  std::function<Eigen::Vector3d(const Eigen::Vector3d& p_mm)> velocity_mm_s;
};

// A vertex that fingers hold: a spring pulls it to a place, that of the end of the step.
struct Grip {
  int vertex = 0;
  Eigen::Vector3d at_mm = Eigen::Vector3d::Zero();
};

// What acts during a step, besides the cloth itself.
struct StepInput {
  Eigen::Vector3d gravity_mm_s2 = {0, 9810, 0};
  Eigen::Isometry3d carry =
      Eigen::Isometry3d::Identity();  // motion of the wearer's trunk; frees the contacts
  const Obstacle* obstacle = nullptr;
  std::vector<int> held;                    // vertices that follow a hand or handle
  std::vector<Eigen::Vector3d> held_at_mm;  // where they are at the end of the step
  std::vector<Grip> grips;                  // at most one a vertex
  double grip_n_per_m = 0;                  // stiffness of their springs
  double drag_per_s = 0;                    // more than the fabric's own, to calm it down
};

struct StepReport {
  int iterations = 0;  // of the conjugate gradients
  int contacts = 0;
  int held_back = 0;  // vertices whose move was shortened to keep layers apart
};

// Backward Euler with one Newton step (Baraff and Witkin 1998) by conjugate gradients with a block Jacobi
// preconditioner. Layers repel each other as springs with friction. KeepApart limits the result, so cloth
// that starts without intersections stays so. Where that holds cloth fast, as between an arm and the trunk,
// or threads are pulled to twice their length, the obstacle does not act for a while, so the cloth sinks in
// instead of being torn. Parallel in the calling thread's TBB arena, the same bytes at any thread count.
class GarmentSolver {
 public:
  GarmentSolver(const std::vector<Face>& faces, const std::vector<std::array<Eigen::Vector2d, 3>>& flat_mm,
                std::vector<Eigen::Vector3d> x_mm, double cell_mm, const JerseyOptions& options,
                const std::vector<Crease>& creases = {});

  StepReport Step(double step_s, const StepInput& input);

  const std::vector<Eigen::Vector3d>& positions_mm() const { return x_; }
  const std::vector<Eigen::Vector3d>& velocities_mm_s() const { return v_; }
  void Stop() { std::fill(v_.begin(), v_.end(), Eigen::Vector3d::Zero()); }
  const Fabric& fabric() const { return fabric_; }
  bool IsFinite() const;

  // What later steps depend on (state_archive.h).
  template <typename Archive>
  void State(Archive& archive) {
    finder_.State(archive);
    archive(x_), archive(v_), archive(dv_), archive(carry_), archive(yields_);
  }

 private:
  struct ClothEdge {
    int a = 0, b = 0;
    double rest_mm = 0;
  };
  // A contact that acts in this step: on its four vertices, by a 3 x 3 stiffness.
  struct Contact {
    std::array<int, 4> v;
    std::array<float, 4> weight;
    Eigen::Matrix3f stiffness;  // times the step squared
    Eigen::Vector3f impulse;
  };
  struct Touch {
    int contact;
    float weight;
  };

  void PushLayersApart(double step_s, const StepInput& input, const std::vector<ContactPair>& pairs);
  void TouchBody(double step_s, const StepInput& input);
  void BuildSystem(double step_s, const StepInput& input);
  void Multiply(const std::vector<Eigen::Vector3f>& p, std::vector<Eigen::Vector3f>& out);
  int Solve();
  void PushOutOfBody(const StepInput& input, std::vector<Eigen::Vector3d>& to_mm) const;

  JerseyOptions options_;
  double cell_mm_, thickness_mm_, reach_mm_, body_gap_mm_;
  Fabric fabric_;
  ContactFinder finder_;
  std::vector<ClothEdge> edges_;
  std::vector<Eigen::Vector3d> x_, v_;
  Eigen::Isometry3d carry_ = Eigen::Isometry3d::Identity();  // of the last step
  std::vector<uint8_t> yields_;  // [vertices], for how many more steps the obstacle acts less or not

  // Of the step at hand.
  std::vector<Contact> contacts_;
  std::vector<int> touch_first_;
  std::vector<Touch> touches_;
  std::vector<Eigen::Matrix3f> local_;    // mass, drag and body, per vertex
  std::vector<Eigen::Matrix3f> inverse_;  // of the diagonal blocks
  std::vector<Eigen::Vector3f> rhs_, dv_, product_, contact_sum_;
  std::vector<uint8_t> is_held_;
  bool is_pressed_ = false;  // layers are somewhere
  float elastic_scale_ = 0;
};

}  // namespace weft
