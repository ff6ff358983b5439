// FRI sessions of an arm: a monitor, then a sine on joint 7 by positions, then torques on an arm that is compliant.
//
//     cmake -S cpp -B build/cpp && cmake --build build/cpp
//     g++ -std=c++17 -O2 -pthread -I cpp/include -I native -I src/heptarm/fri/loop/include -o fri cpp/examples/fri.cpp build/cpp/libheptarm_native.a
//     ./fri localhost:30001 127.0.0.1        # this computer's address as the cabinet reaches it
#include <cmath>
#include <cstdio>

#include "heptarm/fri.hpp"

namespace {

constexpr double PI = 3.14159265358979323846;

// one swing of 2 s that begins and ends at rest
double swing(double time) { return time < 2 ? 0.5 * (1 - std::cos(PI * time)) : 0; }

}  // namespace

int main(int count, char** arguments) {
    using namespace heptarm;
    if (count < 3) {
        std::fprintf(stderr, "usage: fri ADDRESS HOST\n");
        return 2;
    }
    try {
        Arm arm(arguments[1]);
        arm.take_control();
        arm.move(ptp({0, 0.52, 0, -1.57, 0, 1.05, 0}, 0.5));

        FriOptions options;
        options.host = arguments[2];
        options.command = wire::FriCommandMode::monitor;
        {
            Fri monitor(arm, options);
            std::printf("A4 is at %.4f rad\n", monitor.next()->q[3]);
        }

        options.command = wire::FriCommandMode::position;
        {
            Fri fri(arm, options);
            const Joints start = fri.state().q_ipo;
            double time = 0, moved = 0;
            while (const auto state = fri.next()) {
                time += state->period;
                Joints q = start;
                q[6] += 0.1 * swing(time);
                fri.position(q);
                moved = std::fmax(moved, state->q[6] - start[6]);
                if (time > 2.2) break;
            }
            fri.close();
            std::printf("positions: A7 moved %.4f rad\n%s\n", moved, fri.report().c_str());
        }

        options.command = wire::FriCommandMode::torque;
        wire::JointImpedance soft;
        soft.stiffness = {200, 200, 200, 200, 200, 200, 200};
        soft.damping = {0.7, 0.7, 0.7, 0.7, 0.7, 0.7, 0.7};
        options.mode = soft;
        double time = 0, moved = 0, start = 0;
        options.law = [&](const FriState& now, FriCommand& out) {  // in the thread that answers
            if (time == 0) start = now.q[3];
            time += now.period;
            out.tau[3] = 10 * swing(time);
            moved = std::fmax(moved, std::fabs(now.q[3] - start));
        };
        Fri fri(arm, options);
        while (const auto state = fri.next())
            if (time > 2.2) break;
        fri.close();
        std::printf("torques: A4 moved %.4f rad\n%s\n", moved, fri.report().c_str());
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}
