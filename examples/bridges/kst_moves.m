% A program for KST's class, as its users write them: joints and a straight line. Nothing here is heptarm's.
%
%     heptarm bridge kst --target sim://iiwa14
%     octave-cli --path KST/Matlab_client kst_moves.m
if exist('OCTAVE_VERSION', 'builtin')
    pkg load instrument-control
    addpath(fullfile(fileparts(mfilename('fullpath')), 'octave'));  % its tcpip before that of the package
end
ip = getenv('KST_IP');
if isempty(ip)
    ip = '127.0.0.1';
end
iiwa = KST(ip, KST.LBR14R820, KST.None, eye(4));
if ~iiwa.net_establishConnection()
    error('no connection');
end
near = {0.1, 0.6, 0.1, -1.5, 0.1, 0.9, 0.2};
iiwa.movePTPJointSpace(near, 0.5);
off = max(abs(cell2mat(iiwa.getJointsPos()(:)') - cell2mat(near)));
fprintf('joints: %.3f mrad off\n', 1e3 * off);
pose = iiwa.getEEFPos();
target = pose;
target{3} = target{3} - 50;
iiwa.movePTPLineEEF(target, 100);
reached = iiwa.getEEFPos();
off = max(abs(cell2mat(reached(1:3)(:)') - cell2mat(target(1:3)(:)')));
fprintf('line: %.3f mm off\n', off);
iiwa.net_turnOffServer();
