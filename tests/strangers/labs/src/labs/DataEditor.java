package labs;

import static com.kuka.roboticsAPI.motionModel.BasicMotions.*;

import javax.inject.Inject;

import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;
import com.kuka.roboticsAPI.deviceModel.LBR;
import com.kuka.roboticsAPI.deviceModel.JointPosition;
import com.kuka.roboticsAPI.geometricModel.Frame;
import com.kuka.roboticsAPI.geometricModel.ObjectFrame;
import com.kuka.roboticsAPI.geometricModel.SceneGraphObject;
import com.kuka.roboticsAPI.geometricModel.StaticTransformationProvider;
import com.kuka.roboticsAPI.geometricModel.World;
import com.kuka.roboticsAPI.geometricModel.math.Transformation;
import com.kuka.roboticsAPI.persistenceModel.IPersistenceEngine;
import com.kuka.roboticsAPI.persistenceModel.PersistenceException;
import com.kuka.roboticsAPI.persistenceModel.XmlApplicationDataSource;

/** Teaches at run time: new frames in the project's data, renamed, moved and removed. */
public class DataEditor extends RoboticsAPIApplication {
    @Inject
    private LBR lbr;

    @Override
    public void run() throws Exception {
        final IPersistenceEngine engine = getContext().getEngine(IPersistenceEngine.class);
        final XmlApplicationDataSource appData = (XmlApplicationDataSource) engine.getDefaultDataSource();
        appData.open();
        int before = appData.loadAllFrames().size();
        JointPosition joints = new JointPosition(0.2, 0.5, 0.1, -1.5, 0, 0.9, 0);
        ObjectFrame table = getApplicationData().getFrame("/Table");
        ObjectFrame recipe = appData.addFrame(table);
        boolean isNamed = recipe.getName().equals("P3");
        appData.renameFrame(recipe, "Recipe");
        Frame flange = new Frame(World.Current.getRootFrame());
        flange.setTransformationFromParent(lbr.getForwardKinematic(joints));
        appData.changeFrameTransformation(getApplicationData().getFrame("/Table/Recipe"),
                table.transformationTo(flange));
        appData.moveFrame(recipe, World.Current.getRootFrame());
        appData.save();
        appData.saveFile();
        lbr.move(ptp(joints).setJointVelocityRel(0.7));
        ObjectFrame found = getApplicationData().getFrame("/Recipe");
        boolean isThere = lbr.getFlange().isCloseTo(found, 0.1, 1e-3)
                && lbr.getPositionInformation(lbr.getFlange()).getCurrentCartesianPosition().isCloseTo(found, 0.1, 1e-3);
        appData.removeFrame(found);
        boolean isGone = false;
        try {
            getApplicationData().getFrame("/Recipe");
        } catch (PersistenceException e) {
            isGone = appData.loadAllFrames().size() == before && "RoboticsAPI.data.xml".equals(appData.getName());
        }
        boolean isRefused = false;
        try {
            getApplicationData().getProcessData("neverRead").getValue();
        } catch (PersistenceException e) {
            isRefused = e.getMessage().contains("an Integer must be a whole number, got '3,5'");
        }
        isRefused &= getApplicationData().tryGetProcessData("unknown") == null;
        SceneGraphObject owner = lbr;
        ObjectFrame own = new ObjectFrame("own", table, owner, new StaticTransformationProvider(Transformation.ofTranslation(1, 2, 3)));
        boolean isOwn = Math.abs(table.transformationTo(own).getY() - 2) < 1e-9;
        Report.line(getApplicationData(), "DataEditor " + isNamed + " " + isThere + " " + isGone + " " + isRefused + " " + isOwn);
        Report.joints(getApplicationData(), "DataEditor", lbr);
    }
}
