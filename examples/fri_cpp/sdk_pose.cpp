// An application written for the FRI client SDK of Sunrise 2.x, compiled without it: lifts the flange by 30 mm and back, by poses.
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "heptarm/fri_client.hpp"

using namespace KUKA::FRI;

class PoseClient : public LBRClient {
public:
    void waitForCommand() override { robotCommand().setCartesianPose(robotState().getIpoCartesianPose()); }
    void command() override {
        double pose[7];
        for (int i = 0; i < 7; ++i) pose[i] = robotState().getIpoCartesianPose()[i];
        time_ += robotState().getSampleTime();
        pose[2] += 15 * (1 - std::cos(2 * M_PI * std::fmin(time_ / 2, 1.0)));  // [mm]
        robotCommand().setCartesianPose(pose);
        if (first_ == 0) first_ = robotState().getMeasuredCartesianPose()[2];
        lifted_ = std::fmax(lifted_, robotState().getMeasuredCartesianPose()[2] - first_);
        last_ = robotState().getMeasuredCartesianPose()[2] - first_;
    }
    double time_ = 0, first_ = 0, lifted_ = 0, last_ = 0;
};

int main(int, char** arguments) {
    PoseClient client;
    UdpConnection connection(20000);
    ClientApplication application(connection, client);
    if (!application.connect(std::atoi(arguments[1]), "127.0.0.1")) return 2;
    std::printf("waiting on port %d\n", application.port());
    std::fflush(stdout);
    while (application.step() && client.time_ < 2.5) {
    }
    std::printf("lifted %.2f mm, ends at %.2f mm\n%s\n", client.lifted_, client.last_, application.report().c_str());
    application.disconnect();
    return client.time_ > 0 ? 0 : 1;
}
