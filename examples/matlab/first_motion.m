% Connect, move, and read where the arm is: in Octave or MATLAB, with heptarm_mex.cpp compiled here.
%
%     heptarm sim &                                    % a virtual cabinet on port 30001
%     octave-cli first_motion.m                        % HEPTARM_TARGET: another address

address = getenv("HEPTARM_TARGET");
if isempty(address)
    address = "localhost:30001";
end
disp(heptarm_mex("connect", strrep(address, "sim://", "")));
heptarm_mex("ptp", pi / 180 * [0 30 0 -90 0 60 0], 0.5);
above = heptarm_mex("pose");
heptarm_mex("lin_rel", [0 0 -0.1], "base", 0.2);
below = heptarm_mex("pose");
fprintf("down by %.1f mm\n", 1000 * (above(3) - below(3)));
try
    heptarm_mex("ptp", [0 2.6 0 0 0 0 0], 0.5);      % beyond the limit of A2: refused, nothing moves
catch error
    fprintf("refused: %s\n", error.message);
end
heptarm_mex("close");
