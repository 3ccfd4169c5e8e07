// The kinds of building, each built by a file of its own.
#pragma once

#include "host/sim_floor.hpp"

namespace mellin::host {

/// Each adds its walls, places, furniture, doors and ways to an empty floor; deterministic in the options.
void build_ring(Floor& floor, const SimOptions& options);
void build_offices(Floor& floor, const SimOptions& options);
void build_hall(Floor& floor, const SimOptions& options);
void build_corridor(Floor& floor, const SimOptions& options);
void build_flat(Floor& floor, const SimOptions& options);
void build_cave(Floor& floor, const SimOptions& options);

}  // namespace mellin::host
