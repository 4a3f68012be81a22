// SPDX-License-Identifier: BSD-3-Clause
// In place of simulated_tracer.cpp where Embree is not installed.
#include "roslam/common/error.hpp"
#include "simulation/simulated_tracer.hpp"

namespace roslam::simulation {

struct Tracer::Impl {};

Tracer::Tracer() {
  throw InputError(
      "simulated: this program was built without the simulator, which needs Embree (ROSLAM_SIMULATION); "
      "give a recording, or install libembree-dev and build again");
}
Tracer::~Tracer() = default;
void Tracer::build(const Mesh&, bool) {}
void Tracer::intersect(const RayPacket&, HitPacket&) const {}
void Tracer::block(RayPacket&) const {}

}  // namespace roslam::simulation
