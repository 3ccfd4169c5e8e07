#include "mellin/slam.hpp"

namespace mellin {

Result<Slam*> Slam::create(const Config& given, Span<std::byte> memory, const mellin_port& port, Span<std::byte> fast) {
  const Log log(port.log);
  const Status valid = validate(given, log);
  if (valid != Status::ok) {
    return valid;
  }
  const Config config = resolved(given);
  if (!config.screening.hold_digests && port.flash.block_count == 0) {
    log.write(MELLIN_LOG_WARNING, LogLine() << "config: hold_digests is 0, which takes a flash to read digests from");
    return Status::invalid_config;
  }
  MeasureArena measure;
  (void)carve(measure, config);
  const std::size_t needed = fast.empty() ? measure.use().total() : measure.use().bulk;
  if (memory.size() < needed || (!fast.empty() && fast.size() < measure.use().fast)) {
    const std::size_t lacking = memory.size() < needed ? needed - memory.size() : measure.use().fast - fast.size();
    log.write(MELLIN_LOG_WARNING, LogLine() << "the memory given lacks " << std::uint64_t{lacking} << " bytes");
    return Status::insufficient_memory;
  }
  if (reinterpret_cast<std::uintptr_t>(memory.data()) % kArenaAlignment != 0 ||
      reinterpret_cast<std::uintptr_t>(fast.data()) % kArenaAlignment != 0) {
    return Status::invalid_argument;
  }
  Arena arena(memory, fast);
  const Memory parts = carve(arena, config);
  if (!arena.ok()) {
    return Status::insufficient_memory;
  }
  Slam& slam = parts.self[0];
  slam.use_ = arena.use();
  const Status status = slam.init(config, parts, port);
  if (status != Status::ok) {
    return status;
  }
  return &slam;
}

Status Slam::init(const Config& config, const Memory& memory, const mellin_port& port) {
  config_ = config;
  clock_ = port.clock;
  entropy_ = port.entropy;
  log_ = Log(port.log);
  mapper_ =
      ParticleMapper(config_.mapper, memory.mapper, Span<const LaserConfig>(config_.lasers, kMaxLasers), config_.seed);
  builder_ = SubmapBuilder(config_.submaps, memory.builder);
  Status status = store_.init(store_config(config_), memory.store, port.flash, log_);
  if (status == Status::ok) {
    status = open_store();
  }
  if (status == Status::ok) {
    status = screening_.init(config_.screening, memory.screening);
  }
  if (status == Status::ok) {
    status = registration_.init(config_.registration, memory.registration);
  }
  if (status == Status::ok) {
    status = collection_.init(config_.collection, memory.collection, screening_, registration_, store_, clock_, log_);
  }
  if (status != Status::ok) {
    return status;
  }
  while (!collection_.idle()) {
    collection_.step();  // restores what the store holds
  }
  if (collection_.restored() != Status::ok) {
    return collection_.restored();
  }
  return collection_.begin_session(new_session_id());
}

Status Slam::open_store() {
  if (!store_.keeps_data()) {
    return Status::ok;
  }
  const Status status = store_.mount();
  return status == Status::not_found ? store_.format() : status;
}

SessionId Slam::new_session_id() {
  SessionId id;
  if (entropy_.fill == nullptr || entropy_.fill(entropy_.context, id.bytes, sizeof id.bytes) != 0) {
    // Seeded, for replay; the number of submaps tells restarts over one store apart.
    Random random(config_.seed, (std::uint64_t{collection_.session_count()} << 32U) + collection_.size());
    for (std::uint8_t& byte : id.bytes) {
      byte = static_cast<std::uint8_t>(random.bits() >> 56U);
    }
  }
  id.bytes[6] = static_cast<std::uint8_t>((id.bytes[6] & 0x0FU) | 0x40U);  // RFC 4122, version 4
  id.bytes[8] = static_cast<std::uint8_t>((id.bytes[8] & 0x3FU) | 0x80U);
  return id;
}

void Slam::count_since(std::uint64_t before_us, std::uint64_t& spent_us) {
  const std::uint64_t now = now_us();
  spent_us += now >= before_us ? now - before_us : 0;
  statistics_.clock_back += now < before_us ? 1U : 0U;
}

Result<ScanOutcome> Slam::add(const Scan& scan) {
  const std::uint64_t before = now_us();
  const Result<ScanOutcome> outcome = mapper_.add(scan);
  if (outcome.ok() && outcome.value().use == ScanUse::lost) {
    log_.write(MELLIN_LOG_WARNING, LogLine() << "lost at scan " << outcome.value().anchor_scan
                                             << ": the live map begins afresh, in a component of its own");
    statistics_.submaps_lost += builder_.stretch_ended(mapper_) ? 0U : 1U;
  }
  if (outcome.ok() && outcome.value().taken) {
    freeze_if_due(builder_.scan_taken(mapper_));
  }
  count_since(before, statistics_.mapping_us);
  return outcome;
}

void Slam::freeze_if_due(bool due) {
  if (!due && !builder_.has_ended_stretch()) {
    return;
  }
  if (builder_.active() || rendered_) {
    ++statistics_.submaps_delayed;
    return;
  }
  Result<SlotHandle> slot = store_.slots().acquire_free();
  if (!slot.ok()) {
    ++statistics_.submaps_delayed;
    return;
  }
  slot_ = static_cast<SlotHandle&&>(slot.value());
  const Status status = builder_.begin(mapper_, store_.slots().cells(slot_));
  if (status != Status::ok) {
    statistics_.submaps_lost += status == Status::not_found ? 1U : 0U;
    (void)store_.slots().release(slot_);
    return;
  }
  ++statistics_.submaps_due;
}

/// All slots are taken by who reads grids: waiting for one could last for ever.
void Slam::forget_what_cannot_be_frozen() {
  if (builder_.has_ended_stretch()) {
    builder_.forget_ended_stretch();
    ++statistics_.submaps_lost;
  }
}

void Slam::render_slice() {
  const std::uint64_t before = now_us();
  const Result<bool> done = builder_.step(mapper_.scans());
  if (!done.ok()) {
    ++statistics_.submaps_lost;
    (void)store_.slots().release(slot_);
  } else {
    rendered_ = done.value();
  }
  count_since(before, statistics_.rendering_us);
}

void Slam::hand_over() {
  const Result<SubmapId> id = collection_.insert(builder_.header(), slot_, builder_.from_before(), builder_.stretch());
  rendered_ = false;
  if (!id.ok()) {
    ++statistics_.submaps_lost;
    (void)store_.slots().release(slot_);
    log_.write(MELLIN_LOG_WARNING, LogLine() << "a submap is lost: " << to_string(id.status()));
    return;
  }
  if (observer_.frozen != nullptr) {
    observer_.frozen(observer_.context, id.value(), builder_.first_scan(), builder_.submap_T_scan());
  }
}

bool Slam::pending() const {
  return builder_.active() || rendered_ || builder_.has_ended_stretch() || !collection_.idle() || flush_ != Flush::none;
}

bool Slam::work(std::uint32_t budget) {
  for (std::uint32_t i = 0; i < (budget == 0 ? 1 : budget) && pending(); ++i) {
    if (builder_.active()) {
      render_slice();  // first, since scans leave the memory
    } else if (!collection_.idle()) {
      collection_.step();
    } else if (rendered_) {
      hand_over();
    } else if (builder_.has_ended_stretch()) {
      freeze_if_due(true);
      forget_what_cannot_be_frozen();
    } else if (flush_ == Flush::submap) {
      flush_ = Flush::records;
      freeze_if_due(builder_.has_unfrozen());
    } else {
      flush_ = Flush::none;
      collection_.begin_flush();
    }
  }
  return pending();
}

Status Slam::begin_flush() {
  flush_ = Flush::submap;
  return Status::ok;
}

Status Slam::new_session(const Pose2& session_T_base) {
  if (!ParticleMapper::within_reach(session_T_base)) {
    return Status::invalid_argument;
  }
  if (pending()) {
    return Status::busy;
  }
  const Status status = collection_.begin_session(new_session_id());
  if (status == Status::ok) {
    mapper_.reset(session_T_base);
    builder_.reset();
  }
  return status;
}

MapPose Slam::map_pose() const {
  MapPose out;
  const SubmapId newest = collection_.newest_of_session();
  if (newest == kNoSubmap || collection_.stretch_of(newest) != mapper_.stretch()) {
    out.map_T_base = mapper_.pose();
    return out;
  }
  const Pose2 session_T_submap = collection_.header(newest).session_T_submap;
  out.linked = true;
  out.component = collection_.component(newest);
  out.map_T_base = compose(collection_.map_T_submap(newest), between(session_T_submap, mapper_.pose()));
  return out;
}

}  // namespace mellin
