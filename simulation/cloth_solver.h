// The constraint solver behind SimulateMotion.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "simulation/cloth_motion.h"

namespace weft {

// Positions and velocities of a cloth, advanced step by step.
class ClothSolver {
 public:
  ClothSolver(const Cloth& cloth, const FabricOptions& fabric);

  // Vertices that follow handles instead of forces.
  void Pin(const std::vector<int>& vertices);
  // A body of revolution around the y axis that the cloth cannot enter; 0 for none.
  void SetBodyRadius(double radius_mm) { body_radius_mm_ = radius_mm; }

  // One step of `step_s`; `pinned_mm` are the handles' positions at its end, in the order of Pin.
  void Step(double step_s, const Eigen::Vector3d& acceleration_mm_s2,
            const std::vector<Eigen::Vector3d>& pinned_mm);

  std::vector<Eigen::Vector3d>& positions_mm() { return x_; }
  bool IsFinite() const;

 private:
  struct Edge {
    int a, b;
    double rest_mm;
    double compliance;
  };
  // Second difference of three vertices along a grid line, w[0] a + w[1] b + w[2] c, [1/mm].
  struct Bend {
    int a, b, c;
    double wa, wb, wc;
    double compliance;
  };
  struct Pair {
    int a, b;
  };

  void AddEdges(const Cloth& cloth);
  void AddBends(const Cloth& cloth);
  void SolveEdges(double step_s);
  void SolveBends(double step_s);
  void SolveContacts();
  void SolveBody();
  void RefreshContacts();
  void FindPairs();

  FabricOptions fabric_;
  double cell_mm_;
  double thickness_mm_;
  double body_radius_mm_ = 0;
  std::vector<Eigen::Vector3d> rest_, x_, previous_, v_;
  std::vector<double> inverse_mass_;  // 1/kg, 0 for pinned ones
  std::vector<int> pinned_;
  std::vector<Edge> edges_;
  std::vector<Bend> bends_;
  std::vector<Pair> pairs_;
  std::vector<Eigen::Vector3d> at_refresh_;  // positions when pairs_ was made
};

}  // namespace weft
