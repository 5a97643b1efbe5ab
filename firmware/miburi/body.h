// The body: polls the servos, lets the controller decide, takes orders; does not talk to the host.
//
// `Io` must provide what bus.h and memory.h ask of it.
#pragma once

#include "clock.h"
#include "controller.h"
#include "health.h"
#include "hold.h"
#include "link.h"
#include "memory.h"
#include "move.h"
#include "readings.h"

namespace miburi {

template <class Io>
class Body {
 public:
  explicit Body(Io& io) : clock_(io), memory_(io), servos_(io), readings_(servos_),
        health_(servos_), hold_(servos_, readings_, controller_),
        move_(servos_, clock_, rule_, controller_) {}

  // Power-on: nothing moves. Servos that still follow an order from before a reset are stopped.
  void begin() {
    memory_.recall(table_);
    if (table_.complete()) {
      adopt();
    }
    controller_.phase = Phase::stopped;
    controller_.latched = Stop{Reason::started, now(), Contact{Sign::none, NO_MOTOR, 0, 0, 0}};
  }

  // Called again and again; returns true if a reading of the servos was due.
  bool work() {
    const int64_t time = now();
    if (time < next_poll_) {
      return false;
    }
    next_poll_ += POLL;
    if (next_poll_ < time + APART) {
      next_poll_ = time + APART;
    }
    if (table_.complete()) {
      poll();
    } else {
      readings_.pass(time);
    }
    return true;
  }

  // Does what can wait until the report is out. A report that is still going out during the next
  // reading would cost that reading bytes.
  void look_after() {
    if (table_.complete()) {
      look_at(NO_MOTOR);
    }
    memory_.work(table_);
  }

  // The host has said something that could be understood.
  void host_spoke() { heard_ = now(); }

  int64_t time() const { return readings_.time(); }  // of the latest reading
  const Table& table() const { return table_; }
  Stored stored() { return memory_.has(table_); }

  // --- orders: each is carried out, or refused with a reason and its details in `out` ----------

  Result set_settings(const Settings& settings, Writer& out) {
    if (controller_.phase != Phase::stopped) {
      return wrong_phase(out);
    }
    const uint8_t wrong = out_of_range(settings);
    if (wrong != IN_RANGE) {
      out.put(wrong, 1);
      return Result::range;
    }
    table_.settings = settings;
    piece_given(MOTORS);
    return Result::ok;
  }

  Result set_joint(uint8_t index, const Joint& joint, Writer& out) {
    if (controller_.phase != Phase::stopped) {
      return wrong_phase(out);
    }
    const uint8_t wrong = index < MOTORS ? out_of_range(joint) : 0;
    if (wrong != IN_RANGE) {
      out.put(wrong, 1);
      return Result::range;
    }
    table_.joints[index] = joint;
    piece_given(index);
    return Result::ok;
  }

  Result read(uint8_t piece, Writer& out) const {
    if (piece > MOTORS) {
      out.put(0, 1);
      return Result::range;
    }
    if (!(table_.given & (1u << piece))) {
      return Result::settings;
    }
    if (piece == MOTORS) {
      write_settings(table_.settings, out);
    } else {
      write_joint(table_.joints[piece], out);
    }
    return Result::ok;
  }

  Result save(Writer& out) {
    if (controller_.phase != Phase::stopped) {
      return wrong_phase(out);
    }
    if (!table_.complete()) {
      return Result::settings;
    }
    memory_.save();
    return Result::ok;
  }

  Result set_loads(const Load* loads, Writer& out) { return move_.set_loads(loads, out); }

  Result move(const int16_t* goal, const uint16_t* speeds, Writer& out) {
    if (controller_.phase != Phase::idle && controller_.phase != Phase::moving) {
      return wrong_phase(out);
    }
    if (!move_.loaded()) {
      return Result::loads;
    }
    uint8_t wrong = IN_RANGE;
    for (uint8_t i = 0; i < MOTORS; i++) {
      if (!within(goal[i], table_.joints[i].min, table_.joints[i].max) && wrong == IN_RANGE) {
        wrong = i;
      }
    }
    for (uint8_t i = 0; i < MOTORS; i++) {
      if (speeds[i] > table_.settings.max_speed && wrong == IN_RANGE) {
        wrong = static_cast<uint8_t>(MOTORS + i);
      }
    }
    if (wrong != IN_RANGE) {
      out.put(wrong, 1);
      return Result::range;
    }
    go(Phase::moving, goal, speeds);
    out.put(static_cast<uint64_t>(controller_.began), 8);
    return Result::ok;
  }

  Result ask_stop() {
    if (table_.complete() && (controller_.phase != Phase::stopped || led(controller_))) {
      look_around();
      give_up(Reason::asked, NO_MOTOR);
      hold_.tell(table_, move_.orders(), table_.settings.max_speed);
    }
    return Result::ok;
  }

  // The only way out of a stop, and the only place where torque is switched on. Before that, the
  // motors are told to hold the positions where they are.
  Result release(Writer& out) {
    if (controller_.phase != Phase::stopped) {
      return wrong_phase(out);
    }
    if (!move_.loaded()) {
      return Result::loads;
    }
    if (!table_.complete()) {
      return Result::settings;
    }
    for (uint8_t i = 0; i < MOTORS; i++) {
      if (!servos_.set_mode(table_.joints[i].id)) {
        return unready(i, Reason::silent, out);
      }
    }
    // A motor under torque would jump to its goal if it became stiffer, so torque goes off first.
    if (servos_.detuned(table_.joints, gains_of(table_)) != 0) {
      hold_.set_loose(ALL);
      hold_.renew();
      for (uint8_t copies = 0; copies < COPIES; copies++) {
        servos_.set_torque(table_.joints, false);
      }
    }
    // A motor that has just been configured, or that somebody turned by hand, must be read again
    // before its position counts.
    const uint8_t limp = servos_.limp(table_.joints);
    for (uint8_t tries = 0; tries < SETTLED && !look_around(limp); tries++) {
    }
    for (uint8_t i = 0; i < MOTORS; i++) {
      const Reason fault = readings_.fault_now(i);
      if (fault == Reason::faulty) {
        servos_.reboot(table_.joints[i].id);
      }
      if (fault != Reason::none) {
        return unready(i, fault, out);
      }
    }
    uint8_t motor = NO_MOTOR;
    const Reason reason = health_.measure(table_, motor);
    if (reason != Reason::none) {
      return unready(motor, reason, out);
    }
    for (uint8_t i = 0; i < MOTORS; i++) {
      const int16_t beyond = limp & (1u << i) ? LIES_BEYOND : HANGS_BEYOND;
      const int16_t angle = readings_.angles()[i];
      if (distance_between(angle, inside(table_.joints[i], angle)) > beyond) {
        const Result result = unready(i, Reason::outside, out);
        out.put(static_cast<uint16_t>(angle), 2);
        return result;
      }
    }
    // A motor that has been held stays at its goal; one that was moved, or had no torque, starts
    // from where it is.
    bool creeps = false;
    for (uint8_t i = 0; i < MOTORS; i++) {
      const int16_t here = goal_here(controller_, i, readings_.angles());
      if (limp & (1u << i)) {
        hold_.unpin(static_cast<uint8_t>(1u << i));
      } else if (distance_between(here, controller_.origin[i]) > table_.joints[i].guards.arrival) {
        controller_.origin[i] = inside(table_.joints[i], here);
        creeps = true;
      }
    }
    hold_.take_up();
    hold_.set_loose(ALL);
    gains_ = gains_of(table_);
    uint8_t weak = ALL;
    // Bytes are lost now and then, so orders that a motor did not hear are sent again.
    for (uint8_t copies = 0; copies < COPIES && !hold_.told(); copies++) {
      hold_.tell(table_, move_.orders(), table_.settings.return_speed);
    }
    for (uint8_t copies = 0; copies < COPIES && hold_.told() && weak != 0; copies++) {
      servos_.set_torque(table_.joints, true);
      // Gains only after torque: a servo may fall back to its own gains when torque comes on.
      servos_.set_gains(table_.joints, gains_);
      weak = static_cast<uint8_t>(servos_.detuned(table_.joints, gains_) |
                                  servos_.limp(table_.joints));
    }
    hold_.set_loose(weak);
    for (uint8_t i = 0; i < MOTORS; i++) {
      if (weak & (1u << i)) {
        return unready(i, Reason::deaf, out);
      }
    }
    int16_t goal[MOTORS];
    uint16_t speeds[MOTORS];
    for (uint8_t i = 0; i < MOTORS; i++) {
      goal[i] = table_.joints[i].neutral;
    }
    return_speeds(controller_.origin, goal,
                  return_speed(controller_, table_.settings.return_speed), speeds);
    // A motor whose goal has changed must reach it first. Otherwise the remaining distance would be
    // mistaken for the effect of its load, and every release would end as a contact.
    const int64_t until = now() + (creeps ? SETTLING : 0);
    do {
      look_around();
    } while (now() < until);
    go(Phase::returning, goal, speeds);
    out.put(static_cast<uint64_t>(controller_.began), 8);
    return Result::ok;
  }

  Result relax(Writer& out) {
    if (controller_.phase != Phase::stopped) {
      return wrong_phase(out);
    }
    if (!table_.complete()) {
      return Result::settings;
    }
    hold_.let_go();
    servos_.set_torque(table_.joints, false);
    return Result::ok;
  }

  Result identify(uint8_t old_id, uint8_t new_id, Writer& out) {
    if (controller_.phase != Phase::stopped) {
      return wrong_phase(out);
    }
    if (old_id > 252 || new_id > 252) {
      out.put(old_id > 252 ? 0 : 1, 1);
      return Result::range;
    }
    hold_.forget();
    if (!servos_.identify(old_id, new_id)) {
      return unready(NO_MOTOR, Reason::silent, out);
    }
    return Result::ok;
  }

  // Reads some of a servo's registers for the host; never during a move or a return.
  Result peek(uint8_t motor, uint8_t address, uint8_t count, Writer& out) {
    if (controller_.phase == Phase::moving || controller_.phase == Phase::returning) {
      return wrong_phase(out);
    }
    if (!table_.complete()) {
      return Result::settings;
    }
    if (motor >= MOTORS || !within(count, 1, Servos::MOST_PEEKED)) {
      out.put(motor >= MOTORS ? 0 : 2, 1);
      return Result::range;
    }
    const uint8_t* registers = servos_.peek(table_.joints[motor].id, address, count);
    if (registers == nullptr) {
      return unready(motor, Reason::silent, out);
    }
    for (uint8_t i = 0; i < count; i++) {
      out.put(registers[i], 1);
    }
    return Result::ok;
  }

  void report(Writer& out) const {
    const Stop& latched = controller_.latched;
    const bool stopped = controller_.phase == Phase::stopped;
    out.put(static_cast<uint64_t>(time()), 8).put(static_cast<uint8_t>(controller_.phase), 1);
    out.put(stopped ? static_cast<uint8_t>(latched.reason) : 0, 1);
    out.put(latched.contact.motor, 1).put(static_cast<uint8_t>(latched.contact.sign), 1);
    out.put(static_cast<uint32_t>(latched.contact.measured), 4);
    out.put(static_cast<uint32_t>(latched.contact.expected), 4);
    out.put(static_cast<uint64_t>(latched.contact.length), 8);
    out.put(static_cast<uint64_t>(latched.time), 8);
    out.put(readings_.heard(), 1).put((hold_.holds() ? 1u : 0u) | (hold_.limp() ? 2u : 0u), 1);
    for (uint8_t i = 0; i < MOTORS; i++) {
      out.put(static_cast<uint16_t>(readings_.angles()[i]), 2);
    }
    for (uint8_t i = 0; i < MOTORS; i++) {
      out.put(static_cast<uint16_t>(readings_.speed(i) * table_.joints[i].direction), 2);
    }
    for (uint8_t i = 0; i < MOTORS; i++) {
      out.put(health_.of(i).temperature, 1).put(health_.of(i).voltage, 1);
    }
  }

 private:
  static const int32_t POLL = 20000;  // µs between two readings of the servos
  static const int32_t HOST_SILENT = 30000000;  // µs that a host may be silent while the body rests
  // µs between two readings, at least: while the card sends to the host, a servo's bytes get lost.
  static const int32_t APART = 19000;
  // How many steps outside its limits a joint may be at a release. For a limp joint they are few,
  // because its servo may have lost count of its turns; a held joint sags by more, but from a goal
  // within its limits.
  static const int16_t LIES_BEYOND = 8;
  static const int16_t HANGS_BEYOND = HANGS;
  static const int32_t SETTLING = 120000;  // µs: the servos' lag plus GIVE_WAY steps at CREEP

  int64_t now() { return clock_.now(); }

  // The settings in the form that the rule uses.
  void adopt() { rule_ = table_.rule(); }

  // Reads all positions once; returns true if every servo answered and is believed.
  bool look_around() { return look_around(hold_.loose()); }
  bool look_around(uint8_t limp) {
    return readings_.take(table_, now(), limp, controller_.origin, controller_.goal);
  }

  void poll() {
    health_.count_reading();
    const bool moved = controller_.phase != Phase::stopped;
    if (look_around()) {
      update(controller_, rule_, readings_.angles(), time());
      if (yield(controller_, rule_, readings_.angles(), time())) {
        // A hand may lead a joint beyond its limits; it is then held at the limit.
        for (uint8_t i = 0; i < MOTORS && led(controller_); i++) {
          controller_.origin[i] = inside(table_.joints[i], controller_.origin[i]);
        }
        hold_.renew();
      }
    }
    for (uint8_t i = 0; i < MOTORS; i++) {
      const Reason fault = readings_.fault(i);
      if (fault != Reason::none) {
        fail(fault, i);
      }
      if (fault == Reason::astray) {
        controller_.yields_at = 0;
      }
    }
    // If the host has gone, the body must not stay under full torque.
    const bool rests = controller_.phase == Phase::idle ||
                       (controller_.phase == Phase::stopped && led(controller_));
    if (rests && time() - heard_ > HOST_SILENT) {
      give_up(Reason::alone, NO_MOTOR);
    }
    if (controller_.phase == Phase::stopped) {
      hold_.stay(table_, move_.orders());
    } else {
      move_.ease(table_);
    }
    // A motor that seems to have met something may have lost its power.
    if (moved && controller_.phase == Phase::stopped &&
        (controller_.latched.reason == Reason::contact || led(controller_))) {
      look_at(controller_.latched.contact.motor);
    }
  }

  // Checks the health of `motor` or, for NO_MOTOR, whatever is due next.
  void look_at(uint8_t motor) {
    const bool rests = controller_.phase == Phase::idle || controller_.phase == Phase::stopped;
    const Reason reason = health_.look(table_, gains_, hold_.loose(), rests, motor);
    if (reason != Reason::none) {
      fail(reason, motor);
      hold_.stay(table_, move_.orders());
    } else if (motor < MOTORS && (hold_.holds() || controller_.phase == Phase::idle) &&
               !move_.limits(table_, motor)) {
      fail(Reason::deaf, motor);
      hold_.stay(table_, move_.orders());
    }
  }

  // Stops for a fault. A fault with which a stopped body cannot be held any longer replaces the
  // stop's reason.
  void fail(Reason reason, uint8_t motor) {
    const bool limp = reason == Reason::restarted || reason == Reason::faulty;
    const bool kept = hold_.loose() == 0 && controller_.latched.reason != reason;
    if (controller_.phase != Phase::stopped || led(controller_)) {
      give_up(reason, motor);
      if (reason == Reason::silent) {
        hold_.unpin(ALL);  // what was read last may be old
      }
    } else if (kept && (limp || reason == Reason::silent)) {
      lose(controller_, reason, motor, time());
    }
    if (limp) {
      hold_.set_loose(static_cast<uint8_t>(hold_.loose() | (1u << motor)));
    }
  }

  void give_up(Reason reason, uint8_t motor) {
    stop(controller_, reason, motor, readings_.angles(), time());
  }

  void go(Phase phase, const int16_t* goal, const uint16_t* speeds) {
    hold_.move_on();
    const uint8_t deaf = move_.go(table_, phase, goal, speeds, readings_.angles());
    // A motor that does not answer at all is caught by the readings.
    for (uint8_t i = 0; i < MOTORS; i++) {
      if (deaf & (1u << i)) {
        give_up(Reason::deaf, i);
      }
    }
  }

  void piece_given(uint8_t piece) {
    table_.given = static_cast<uint16_t>(table_.given | (1u << piece));
    if (table_.complete() && !table_.ids_differ()) {
      table_.given = static_cast<uint16_t>(table_.given & ~(1u << piece));
    }
    adopt();
    // Under new settings, known positions and the positions to hold mean something else, so they
    // are discarded.
    hold_.forget();
    readings_.forget(now());
    for (uint8_t i = 0; i < MOTORS; i++) {
      controller_.sag[i] = 0;
    }
  }

  Result wrong_phase(Writer& out) const {
    out.put(static_cast<uint8_t>(controller_.phase), 1);
    return Result::phase;
  }
  Result unready(uint8_t motor, Reason reason, Writer& out) const {
    out.put(motor, 1).put(static_cast<uint8_t>(reason), 1);
    return Result::servo;
  }

  using Servos = Xl330<Io>;

  Clock<Io> clock_;
  Memory<Io> memory_;
  Servos servos_;
  Readings<Servos> readings_;
  HealthWatch<Servos> health_;
  Hold<Servos> hold_;
  Move<Io> move_;
  Table table_ = Table();
  Rule rule_ = Rule();
  Controller controller_ = Controller();

  int64_t next_poll_ = 0;
  int64_t heard_ = 0;  // when the host last spoke

  Gains gains_ = {};             // as last written; p is 0 before that
};

}  // namespace miburi
