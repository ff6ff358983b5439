// Kinematics of an LBR in C++17: what heptarm.model computes in Python, by the same C. It needs no connection.
//
// Link what cpp/CMakeLists.txt compiles. Frames are the flange's in the base, joints [rad], lengths [m].
#pragma once

#include <math.h>
#include <string.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>
#include <string>

#include "heptarm.hpp"
#include "models.hpp"

namespace heptarm {
namespace native {
extern "C" {
#include "redundancy.h"
#undef DAMPING
}
}  // namespace native

/// What a solution is to keep; what is not given is free.
struct SolveOptions {
    std::optional<Joints> near;       ///< the arm position to stay next to [rad]; none: a usual bent arm
    std::optional<double> e1;         ///< Sunrise's E1, the angle of A3 [rad]
    std::optional<int> status;        ///< Sunrise's Status, bits 0 to 2
};

/// Kinematics of one robot.
class Kinematics {
public:
    /// Columns are joints; rows are the velocity of a point and the angular velocity, in base axes.
    using Jacobian = std::array<std::array<double, 7>, 6>;

    /// Args: the robot, "iiwa7", "iiwa14", "med7" or "med14"; throws std::invalid_argument for another name.
    explicit Kinematics(const std::string& model) : model_(&robot_model(model)) {
        const double* d = model_->lengths;
        arm_.d_bs = d[0], arm_.d_se = d[1], arm_.d_ew = d[2], arm_.d_wf = d[3];
        arm_.chain.origin[1][2] = arm_.d_bs, arm_.chain.origin[3][2] = arm_.d_se, arm_.chain.origin[5][2] = arm_.d_ew;
        arm_.chain.flange[2] = arm_.d_wf;
        std::copy_n(model_->q_min, 7, arm_.q_min);
        std::copy_n(model_->q_max, 7, arm_.q_max);
    }

    /// Limits, link data and the name.
    const RobotModel& model() const { return *model_; }

    /// The flange for joint positions. Throws LimitError for a number that is not finite, as all of these do.
    wire::Pose forward(const Joints& q) const {
        const auto m = matrix(q);
        wire::Pose pose;
        double turn[9];
        for (int i = 0; i < 3; i++) {
            for (int j = 0; j < 3; j++) turn[3 * i + j] = m[std::size_t(4 * i + j)];
            pose.xyz[std::size_t(i)] = m[std::size_t(4 * i + 3)];
        }
        native::quaternion(turn, pose.quat.data());
        return pose;
    }

    /// Args: joint positions; a point that moves with the flange, in the base, or none: the flange's origin.
    Jacobian jacobian(const Joints& q, const std::optional<std::array<double, 3>>& point = std::nullopt) const {
        finite(q, "q");
        if (point) finite(*point, "point");
        Jacobian found;
        native::hk_jacobian(&arm_, 1, q.data(), point ? point->data() : nullptr, found[0].data());
        return found;
    }

    /// Joint positions within the limits for a flange pose.
    ///
    /// E1 and Status are kept if given. Otherwise A3 and Status stay those of `near`, unless another arm position needs
    /// less than a fifth of that way. Where axes coincide, so that the pose does not determine joints, those stay as near
    /// to `near` as the pose allows. Throws LimitError, whose code is Code::unreachable if there is no such position.
    Joints solve(const wire::Pose& pose, const SolveOptions& options = {}) const {
        finite(pose.xyz, "pose.xyz");
        finite(pose.quat, "pose.quat");
        if (options.near) finite(*options.near, "near");
        if (options.e1) finite(std::array<double, 1>{*options.e1}, "e1");
        if (options.status && (*options.status < 0 || *options.status > 7))
            throw refused("status", std::to_string(*options.status), "0 to 7");
        const auto goal = matrix(pose);
        const double e1 = options.e1.value_or(std::numeric_limits<double>::quiet_NaN());
        const int status = options.status.value_or(-1);
        Joints q;
        int outcome = 0;
        native::hi_solve(&arm_, 1, goal.data(), &e1, &status, options.near ? options.near->data() : nullptr, options.e1.has_value(),
                         q.data(), &outcome);
        if (outcome == native::TOO_FAR) throw too_far(goal);
        if (outcome == native::NO_POSTURE) throw no_posture(options);
        return q;
    }

    /// Sunrise's E1, Status and Turn of joint positions.
    wire::Redundancy redundancy(const Joints& q) const {
        finite(q, "q");
        wire::Redundancy found;
        found.e1 = q[2], found.status = native::hi_status(&arm_, q.data()), found.turn = 0;
        for (int i = 0; i < 7; i++) found.turn |= int(q[std::size_t(i)] < 0) << i;
        return found;
    }

    /// The elbow's turn about the line from shoulder to wrist, from the arm with A3 = 0, in (-pi, pi] [rad]; not E1.
    double arm_angle(const Joints& q) const {
        finite(q, "q");
        return native::hi_arm_angle(&arm_, q.data());
    }

    /// The wrench on the flange, base axes [N, Nm], that explains external torques of the joints [Nm] best.
    std::array<double, 6> wrench(const Joints& q, const Joints& tau) const {
        finite(q, "q");
        finite(tau, "tau");
        native::wrench_map map;
        std::array<double, 6> found{};
        if (native::map_wrenches(&arm_.chain, q.data(), &map)) native::explain_torques(&map, tau.data(), found.data());
        return found;
    }

private:
    using Matrix = std::array<double, 16>;

    static LimitError refused(const std::string& parameter, const std::string& value, const std::string& allowed) {
        LimitError error(parameter + " must be " + allowed + ", got " + value, int(Code::out_of_range));
        error.parameter = parameter, error.value = value, error.allowed = allowed;
        return error;
    }

    template <std::size_t size>
    static void finite(const std::array<double, size>& values, const std::string& parameter) {
        for (std::size_t i = 0; i < size; i++)
            if (!std::isfinite(values[i]))
                throw refused(size == 1 ? parameter : parameter + "[" + std::to_string(i) + "]", std::to_string(values[i]), "a finite number");
    }

    static std::string text(double value, const char* format = "%.3f") {
        char line[32];
        std::snprintf(line, sizeof line, format, value);
        return line;
    }

    Matrix matrix(const Joints& q) const {
        finite(q, "q");
        Matrix found;
        native::hk_forward(&arm_, 1, q.data(), found.data());
        return found;
    }

    static Matrix matrix(const wire::Pose& pose) {
        double size = 0, quat[4], turn[9];
        for (double part : pose.quat) size += part * part;
        if (!(std::abs(std::sqrt(size) - 1) < 1e-3)) throw refused("pose.quat", "length " + text(std::sqrt(size)), "of unit length");
        for (int i = 0; i < 4; i++) quat[i] = pose.quat[std::size_t(i)] / std::sqrt(size);
        native::rotation(quat, turn);
        Matrix found{};
        for (int i = 0; i < 3; i++) {
            for (int j = 0; j < 3; j++) found[std::size_t(4 * i + j)] = turn[3 * i + j];
            found[std::size_t(4 * i + 3)] = pose.xyz[std::size_t(i)];
        }
        found[15] = 1;
        return found;
    }

    LimitError too_far(const Matrix& goal) const {
        double wrist[3];
        for (int i = 0; i < 3; i++) wrist[i] = goal[std::size_t(4 * i + 3)] - arm_.d_wf * goal[std::size_t(4 * i + 2)];
        const double away = std::hypot(wrist[0], wrist[1], wrist[2] - arm_.d_bs);
        const std::string least = text(std::abs(arm_.d_se - arm_.d_ew)), most = text(arm_.d_se + arm_.d_ew);
        LimitError error("the wrist would be " + text(away) + " m from the shoulder; the " + model_->title + " reaches " + least + " to " + most + " m",
                         int(Code::unreachable), "bring the target nearer, or change its orientation");
        error.parameter = "pose", error.value = text(away), error.allowed = "[" + least + ", " + most + "] m";
        return error;
    }

    LimitError no_posture(const SolveOptions& options) const {
        if (options.e1 && !(model_->q_min[2] <= *options.e1 && *options.e1 <= model_->q_max[2])) {
            const std::string range = "[" + text(model_->q_min[2], "%.4f") + ", " + text(model_->q_max[2], "%.4f") + "] rad";
            LimitError error("E1 is the angle of A3, which must be in " + range + " on the " + model_->title + ", got " + text(*options.e1, "%.4f") + " rad",
                             int(Code::unreachable), "keep E1 inside the limits of A3, or leave it free");
            error.parameter = "e1", error.value = text(*options.e1, "%.4f"), error.allowed = range;
            return error;
        }
        const bool fixed = options.e1 || options.status;
        return LimitError(std::string("the pose is within reach, but every arm position that reaches it") + (fixed ? " with that E1 or Status" : "") +
                              " violates a joint limit",
                          int(Code::unreachable), fixed ? "change the orientation, or leave E1 or Status free" : "change the orientation");
    }

    const RobotModel* model_;
    native::arm arm_{};
};

}  // namespace heptarm
